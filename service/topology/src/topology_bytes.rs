//! A topology as bytes: what cannot be computed from the rest, in a fixed order.
//!
//! ```text
//! format      1 byte
//! rectangle   edge of a cell in metres (f64), first column and row (i32), width and height (u32)
//! rows        lowest first: (region + 1, or 0 where not free; cells) for each run along +x
//! regions     (id, cell of the centre, clearance in metres (f64)) for each
//! arcs        number; (id, the two cells that the line joins, number of steps,
//!             (index of the left cell from the last, direction of the right cell) for each)
//! meet points number; (kind, cell, clearance in metres (f64)) for each
//! ```
//!
//! All numbers without a type are of variable length (`topology_reader.rs`). Regions are counted in
//! the order of their first cells. Equal topologies are equal bytes, and bytes are not compressed: runs
//! of like rows are left to the store's zstd.

use crate::graph::Arc;
use crate::lattice::Lattice;
use crate::meet_points::{MeetPoint, MeetPointKind};
use crate::regions::{Partition, RegionIndex};
use crate::topology::Topology;
use crate::topology_reader::Reader;

/// First byte: the format that follows.
const FORMAT: u8 = 1;

/// Bytes that are no topology.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum InvalidTopology {
    /// The first byte names no known format.
    #[error("topology format {0} is not known")]
    Format(u8),
    /// The bytes end too early.
    #[error("the topology ends after {0} bytes, in the middle of something")]
    Short(usize),
    /// There are more bytes than the topology needs.
    #[error("{0} bytes follow the topology's end")]
    Surplus(usize),
    /// A number does not fit what it counts or names.
    #[error("a number before byte {0} is too large")]
    Number(usize),
    /// A length is negative or not finite, or the edge of a cell is 0.
    #[error("{0} m is no length")]
    Length(f64),
    /// The rectangle has no room for a rim, more cells than [`Topology::N_CELLS_MAX`], or cells
    /// that have no name.
    #[error(
        "{width} by {height} cells are fewer than 2 by 2, more than {} or out of reach",
        Topology::N_CELLS_MAX
    )]
    Extent {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// Runs are empty or too long, a region is not the next one, or the rim is free.
    #[error("the runs of row {0} are not those of regions")]
    Row(u32),
    /// A region's centre lies outside of it, or its id is another's.
    #[error("region {0} has its centre elsewhere or another's id")]
    Region(u32),
    /// A line or portal is not one between two regions, or the arc's id is another's.
    #[error("arc {0} does not lead from one region to another, or has another's id")]
    Arc(u32),
    /// A meet point lies outside, or is of no known kind.
    #[error("meet point {0} is of no known kind or lies outside")]
    MeetPoint(u32),
}

impl Topology {
    /// The largest rectangle that is read from bytes: 2^26 cells, 410 m a side at 0.05 m a cell,
    /// and 256 MiB in memory.
    pub const N_CELLS_MAX: usize = 1 << 26;

    /// Equal topologies are equal bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let Self { partition, graph, ids, meet_points } = self;
        let mut writer = Writer { bytes: vec![FORMAT] };
        writer.write_partition(partition);
        let frame = partition.info().frame;
        // Every centre is a cell of the rectangle.
        let index_at = |point| partition.info().index_of(frame.cell_at(point)).unwrap_or_default();
        for (region, id) in graph.regions.iter().zip(&ids.regions) {
            writer.write(id.0);
            writer.write(index_at(region.center) as u64);
            writer.write_f64(region.clearance_m);
        }
        writer.write(graph.arcs.len() as u64);
        for (arc, id) in graph.arcs.iter().zip(&ids.arcs) {
            writer.write(id.0);
            for end in arc.line {
                writer.write(index_at(end) as u64);
            }
            writer.write_portal(partition, arc);
        }
        writer.write(meet_points.len() as u64);
        for &MeetPoint { kind, index, position: _, clearance_m } in meet_points {
            writer.write(match kind {
                MeetPointKind::Junction => 0,
                MeetPointKind::Corner => 1,
                MeetPointKind::DeadEnd => 2,
            });
            writer.write(index as u64);
            writer.write_f64(clearance_m);
        }
        writer.bytes
    }

    /// What [`Self::to_bytes`] wrote.
    ///
    /// # Errors
    /// [`InvalidTopology`] if the bytes are something else, or the rectangle has more than
    /// [`Self::N_CELLS_MAX`] cells.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, InvalidTopology> {
        let mut reader = Reader::new(FORMAT, bytes)?;
        let topology = reader.read_topology()?;
        reader.finish()?;
        Ok(topology)
    }
}

struct Writer {
    bytes: Vec<u8>,
}

impl Writer {
    /// Seven bits a byte, the lowest first, the eighth bit set in all but the last byte (LEB128).
    fn write(&mut self, mut number: u64) {
        while 0x80 <= number {
            self.bytes.push((number & 0x7f) as u8 | 0x80);
            number >>= 7;
        }
        self.bytes.push((number & 0x7f) as u8);
    }

    fn write_f64(&mut self, number: f64) {
        self.bytes.extend_from_slice(&number.to_le_bytes());
    }

    fn write_partition(&mut self, partition: &Partition) {
        let info = partition.info();
        self.write_f64(info.frame.resolution_m());
        for number in [info.first.x, info.first.y] {
            self.bytes.extend_from_slice(&number.to_le_bytes());
        }
        for number in [info.width, info.height] {
            self.bytes.extend_from_slice(&number.to_le_bytes());
        }
        let symbol = |region: Option<RegionIndex>| region.map_or(0, |region| region.0 + 1);
        for y in 0..info.height as usize {
            let row = y * info.width as usize..(y + 1) * info.width as usize;
            let mut run = (0, 0);
            for index in row {
                let symbol = symbol(partition.region_at(index));
                if symbol != run.0 && 0 < run.1 {
                    self.write_run(run);
                    run.1 = 0;
                }
                run = (symbol, run.1 + 1);
            }
            self.write_run(run);
        }
    }

    fn write_run(&mut self, (symbol, n_cells): (u32, u64)) {
        self.write(u64::from(symbol));
        self.write(n_cells);
    }

    /// Steps in their order; left cells ascend.
    fn write_portal(&mut self, partition: &Partition, arc: &Arc) {
        let lattice = Lattice::new(partition.info());
        self.write(arc.portal.len() as u64);
        let mut last = 0;
        for step in &arc.portal {
            self.write(step.left.saturating_sub(last) as u64);
            last = step.left;
            let beside = lattice.beside(step.left);
            let direction = beside.iter().position(|&cell| cell == step.right);
            self.write(direction.unwrap_or_default() as u64);
        }
    }
}
