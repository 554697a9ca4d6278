//! Least sums of 16-bit differences, eight columns at a time.
//!
//! ```text
//! min over i, j of rows[i] + between[i][j] + columns[j]
//! ```
//!
//! Sums saturate: `u16::MAX` is an unreachable node, or a sum that has to be taken with more bits.
//! Rows are filled up to whole words of eight, so that neither loops nor words have an end to look
//! after; every x86-64 has these sums, and least values by two subtractions. Time O(rows * columns / 8).

use wide::u16x8;

use crate::gates::GATE_NODES_MAX;

/// Columns that are looked at together.
pub(crate) const LANES: usize = 8;
const N_WORDS_MAX: usize = GATE_NODES_MAX / LANES;

type Word = [u16; LANES];

/// Columns that a row of so many takes up.
pub(crate) fn stride(n_columns: usize) -> usize {
    n_columns.next_multiple_of(LANES)
}

/// Differences to the nodes of one gate, filled up with `u16::MAX`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Columns([Word; N_WORDS_MAX]);

impl Columns {
    /// Of [`GATE_NODES_MAX`] nodes at most.
    pub(crate) fn new(columns: &[u16]) -> Self {
        let mut words = [[u16::MAX; LANES]; N_WORDS_MAX];
        for (to, &from) in words.as_flattened_mut().iter_mut().zip(columns) {
            *to = from;
        }
        Self(words)
    }

    fn at(&self, column: usize) -> u16 {
        self.0.as_flattened()[column]
    }
}

/// The least sum of a block: one row of [`stride`] columns an entry of `rows`.
pub(crate) fn least_sum(rows: &[u16], between: &[u16], columns: &Columns) -> u16 {
    let sums = sums_by_column(rows, between).0.into_iter().zip(columns.0);
    let sums = sums.map(|(sums, columns)| u16x8::new(sums).saturating_add(u16x8::new(columns)));
    let least = sums.fold(u16x8::MAX, lesser);
    least.to_array().into_iter().min().unwrap_or(u16::MAX)
}

/// Row and column of the first sum that is `wanted`, by rows.
pub(crate) fn first_by_row(
    rows: &[u16],
    between: &[u16],
    columns: &Columns,
    wanted: u16,
) -> Option<(usize, usize)> {
    let lines = between.chunks_exact(between.len() / rows.len().max(1));
    rows.iter().zip(lines).enumerate().find_map(|(row, (&extra, line))| {
        let column = line.iter().zip(columns.0.as_flattened()).position(|(&between, &column)| {
            extra.saturating_add(between).saturating_add(column) == wanted
        });
        column.map(|column| (row, column))
    })
}

/// Row and column of the first sum that is `wanted`, by columns.
pub(crate) fn first_by_column(
    rows: &[u16],
    between: &[u16],
    columns: &Columns,
    wanted: u16,
) -> Option<(usize, usize)> {
    let least = sums_by_column(rows, between);
    let sums = least.0.as_flattened().iter().zip(columns.0.as_flattened());
    let column =
        sums.into_iter().position(|(sum, &column)| sum.saturating_add(column) == wanted)?;
    let lines = between.chunks_exact(between.len() / rows.len().max(1));
    let row = rows.iter().zip(lines).position(|(extra, line)| {
        extra.saturating_add(line[column]).saturating_add(columns.at(column)) == wanted
    });
    row.map(|row| (row, column))
}

/// `min over i of rows[i] + between[i][j]`, for every column j.
fn sums_by_column(rows: &[u16], between: &[u16]) -> Columns {
    let (words, _) = between.as_chunks::<LANES>();
    match words.len() / rows.len().max(1) {
        0 | 1 => sums_of_words::<1>(rows, words),
        2 => sums_of_words::<2>(rows, words),
        3 => sums_of_words::<3>(rows, words),
        _ => sums_of_words::<N_WORDS_MAX>(rows, words),
    }
}

/// The same for rows of `N` words: few enough to stay in registers.
fn sums_of_words<const N: usize>(rows: &[u16], words: &[Word]) -> Columns {
    let (lines, _) = words.as_chunks::<N>();
    let mut least = [u16x8::MAX; N];
    for (&row, line) in rows.iter().zip(lines) {
        let row = u16x8::splat(row);
        for (least, &between) in least.iter_mut().zip(line) {
            *least = lesser(*least, row.saturating_add(u16x8::new(between)));
        }
    }
    let mut all = [[u16::MAX; LANES]; N_WORDS_MAX];
    for (all, least) in all.iter_mut().zip(least) {
        *all = least.to_array();
    }
    Columns(all)
}

/// The lesser of each two.
fn lesser(a: u16x8, b: u16x8) -> u16x8 {
    a - a.saturating_sub(b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Rows, a block of whole words a row, and columns.
    fn sums() -> impl Strategy<Value = (Vec<u16>, Vec<u16>, Vec<u16>)> {
        let cost = prop_oneof![0..20_u16, any::<u16>(), Just(u16::MAX)];
        (1..=GATE_NODES_MAX, 1..=GATE_NODES_MAX).prop_flat_map(move |(n_rows, n_columns)| {
            let costs = |n: usize| prop::collection::vec(cost.clone(), n);
            (costs(n_rows), costs(n_rows * stride(n_columns)), costs(n_columns))
        })
    }

    proptest! {
        #[test]
        fn the_least_sum_is_that_of_all_pairs((rows, mut between, columns) in sums()) {
            let stride = stride(columns.len());
            for line in between.chunks_exact_mut(stride) {
                line[columns.len()..].fill(u16::MAX);
            }
            let sum = |row: usize, column: usize| {
                let [a, b, c] = [rows[row], between[row * stride + column], columns[column]];
                (u32::from(a) + u32::from(b) + u32::from(c)).min(u32::from(u16::MAX))
            };
            let pairs: Vec<_> = (0..rows.len())
                .flat_map(|row| (0..columns.len()).map(move |column| (row, column)))
                .collect();
            let least = pairs.iter().map(|&(row, column)| sum(row, column)).min();
            let padded = Columns::new(&columns);
            let found = least_sum(&rows, &between, &padded);
            prop_assert_eq!(Some(u32::from(found)), least, "the least sum");
            let is_it = |&(row, column): &(usize, usize)| sum(row, column) == u32::from(found);
            let first = pairs.iter().copied().find(is_it);
            prop_assert_eq!(first_by_row(&rows, &between, &padded, found), first, "by rows");
            let by_column = pairs.iter().copied().filter(is_it).min_by_key(|&(row, column)| (column, row));
            prop_assert_eq!(first_by_column(&rows, &between, &padded, found), by_column, "by columns");
        }
    }
}
