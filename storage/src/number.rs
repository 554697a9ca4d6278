//! Counts in Rust are unsigned, SQL knows signed numbers only.

/// A count as SQL keeps it. What is beyond 2⁶³ - 1 becomes that: no row has it, so that a search
/// finds nothing; what is written has been checked against [`COUNT_MAX`].
pub(crate) fn to_sql(count: u64) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX)
}

/// Largest count taken from outside: 2⁵³, up to which JSON carries numbers exactly.
pub(crate) const COUNT_MAX: u64 = 1 << 53;
