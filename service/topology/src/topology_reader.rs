//! Reads a topology, whoever wrote the bytes: memory grows with what has been read and found right,
//! and nothing that is read is taken for an index unseen.

use std::collections::HashSet;

use meetpoint_geometry::{Cell, GridFrame, GridInfo};

use crate::cut::Crossing;
use crate::graph::{Arc, Region, TopologicalGraph};
use crate::ids::{ArcId, Ids, RegionId};
use crate::lattice::Lattice;
use crate::meet_points::{MeetPoint, MeetPointKind};
use crate::regions::{NOT_FREE, Partition, RegionIndex};
use crate::topology::Topology;
use crate::topology_bytes::InvalidTopology;

/// What is left of the bytes.
pub(crate) struct Reader<'a> {
    all: &'a [u8],
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    pub(crate) fn new(format: u8, bytes: &'a [u8]) -> Result<Self, InvalidTopology> {
        let (&found, rest) = bytes.split_first().ok_or(InvalidTopology::Short(0))?;
        if found != format {
            return Err(InvalidTopology::Format(found));
        }
        Ok(Self { all: bytes, rest })
    }

    pub(crate) fn finish(self) -> Result<(), InvalidTopology> {
        if self.rest.is_empty() { Ok(()) } else { Err(InvalidTopology::Surplus(self.rest.len())) }
    }

    pub(crate) fn read_topology(&mut self) -> Result<Topology, InvalidTopology> {
        let partition = self.read_partition()?;
        let (regions, region_ids) = self.read_regions(&partition)?;
        let (arcs, arc_ids) = self.read_arcs(&partition)?;
        let meet_points = self.read_meet_points(partition.info())?;
        let graph = TopologicalGraph { regions, arcs };
        let ids = Ids { regions: region_ids, arcs: arc_ids };
        Ok(Topology { partition, graph, ids, meet_points })
    }

    fn read_bytes<const N: usize>(&mut self) -> Result<[u8; N], InvalidTopology> {
        let split = self.rest.split_first_chunk();
        let (bytes, rest) = split.ok_or(InvalidTopology::Short(self.all.len()))?;
        self.rest = rest;
        Ok(*bytes)
    }

    /// A number in the shortest form that it has.
    fn read(&mut self) -> Result<u64, InvalidTopology> {
        let mut number = 0;
        for shift in (0..64).step_by(7) {
            let [byte] = self.read_bytes()?;
            let bits = u64::from(byte & 0x7f);
            let is_last = byte & 0x80 == 0;
            let fits = bits << shift >> shift == bits && !(is_last && bits == 0 && 0 < shift);
            number |= bits << shift;
            match (fits, is_last) {
                (true, true) => return Ok(number),
                (true, false) => {}
                (false, _) => break,
            }
        }
        Err(self.too_large())
    }

    fn too_large(&self) -> InvalidTopology {
        InvalidTopology::Number(self.all.len() - self.rest.len())
    }

    fn read_u32(&mut self) -> Result<u32, InvalidTopology> {
        u32::try_from(self.read()?).map_err(|_| self.too_large())
    }

    /// The index of a cell.
    fn read_index(&mut self, info: GridInfo) -> Result<usize, InvalidTopology> {
        let index = usize::try_from(self.read()?).map_err(|_| self.too_large())?;
        if index < info.n_cells() { Ok(index) } else { Err(self.too_large()) }
    }

    /// A length of 0 or more, in metres.
    fn read_m(&mut self) -> Result<f64, InvalidTopology> {
        let length_m = f64::from_le_bytes(self.read_bytes()?);
        let is_length = length_m.is_finite() && length_m.is_sign_positive();
        if is_length { Ok(length_m) } else { Err(InvalidTopology::Length(length_m)) }
    }

    fn read_info(&mut self) -> Result<GridInfo, InvalidTopology> {
        let resolution_m = f64::from_le_bytes(self.read_bytes()?);
        let frame =
            GridFrame::new(resolution_m).map_err(|_| InvalidTopology::Length(resolution_m))?;
        let [x, y] = [self.read_bytes()?, self.read_bytes()?].map(i32::from_le_bytes);
        let [width, height] = [self.read_bytes()?, self.read_bytes()?].map(u32::from_le_bytes);
        let has_names = |first: i32, n: u32| first.checked_add_unsigned(n).is_some();
        let n_cells = u64::from(width) * u64::from(height);
        let is_right = 2 <= width.min(height)
            && n_cells <= Topology::N_CELLS_MAX as u64
            && has_names(x, width)
            && has_names(y, height);
        if !is_right {
            return Err(InvalidTopology::Extent { width, height });
        }
        Ok(GridInfo { frame, first: Cell { x, y }, width, height })
    }

    fn read_partition(&mut self) -> Result<Partition, InvalidTopology> {
        let info = self.read_info()?;
        let mut of_cell: Vec<u32> = vec![];
        let mut n_regions = 0;
        for y in 0..info.height {
            let mut left = info.width;
            while 0 < left {
                let (symbol, n_cells) = (self.read_u32()?, self.read_u32()?);
                if n_cells == 0 || left < n_cells || n_regions + 1 < symbol {
                    return Err(InvalidTopology::Row(y));
                }
                left -= n_cells;
                n_regions = n_regions.max(symbol);
                let region = symbol.checked_sub(1).unwrap_or(NOT_FREE);
                of_cell.extend(std::iter::repeat_n(region, n_cells as usize));
            }
            let row = &of_cell[y as usize * info.width as usize..];
            let is_edge = y == 0 || y + 1 == info.height;
            let rim = if is_edge { row } else { &row[..1] };
            if rim.iter().chain(row.last()).any(|&region| region != NOT_FREE) {
                return Err(InvalidTopology::Row(y));
            }
        }
        Ok(Partition::from_cells(info, n_regions, of_cell))
    }

    fn read_regions(
        &mut self,
        partition: &Partition,
    ) -> Result<(Vec<Region>, Vec<RegionId>), InvalidTopology> {
        let info = partition.info();
        let lattice = Lattice::new(info);
        let (mut regions, mut ids) = (vec![], vec![]);
        let mut seen = HashSet::new();
        for (n_cells, region) in partition.sizes().into_iter().zip(0..) {
            let id = RegionId(self.read()?);
            let center = self.read_index(info)?;
            let is_right =
                seen.insert(id) && partition.region_at(center) == Some(RegionIndex(region));
            if !is_right {
                return Err(InvalidTopology::Region(region));
            }
            ids.push(id);
            let center = info.frame.center_of(lattice.cell(center));
            regions.push(Region::new(info.frame, n_cells, center, self.read_m()?));
        }
        Ok((regions, ids))
    }

    fn read_arcs(
        &mut self,
        partition: &Partition,
    ) -> Result<(Vec<Arc>, Vec<ArcId>), InvalidTopology> {
        let info = partition.info();
        let (mut arcs, mut ids) = (vec![], vec![]);
        let mut seen = HashSet::new();
        for number in 0..self.read_u32()? {
            let id = ArcId(self.read()?);
            let basis = [self.read_index(info)?, self.read_index(info)?];
            let portal = self.read_portal(partition)?;
            let regions = sides(partition, &portal).filter(|_| basis[0] != basis[1]);
            let regions = regions.filter(|_| seen.insert(id));
            let regions = regions.ok_or(InvalidTopology::Arc(number))?;
            ids.push(id);
            arcs.push(Arc::new(Lattice::new(info), basis, regions, portal));
        }
        Ok((arcs, ids))
    }

    /// Steps that begin in free cells.
    fn read_portal(&mut self, partition: &Partition) -> Result<Vec<Crossing>, InvalidTopology> {
        let info = partition.info();
        let lattice = Lattice::new(info);
        let mut portal = vec![];
        let mut left = 0_usize;
        for _ in 0..self.read_u32()? {
            left = left.saturating_add(self.read_index(info)?);
            let direction = self.read_index(info)?;
            // Free cells do not lie on the rim: they have cells beside them.
            let is_free = left < info.n_cells() && partition.region_at(left).is_some();
            let right = if is_free { lattice.beside(left).get(direction).copied() } else { None };
            portal.push(Crossing { left, right: right.ok_or_else(|| self.too_large())? });
        }
        Ok(portal)
    }

    fn read_meet_points(&mut self, info: GridInfo) -> Result<Vec<MeetPoint>, InvalidTopology> {
        let lattice = Lattice::new(info);
        let mut points = vec![];
        for number in 0..self.read_u32()? {
            let kind = match self.read()? {
                0 => MeetPointKind::Junction,
                1 => MeetPointKind::Corner,
                2 => MeetPointKind::DeadEnd,
                _ => return Err(InvalidTopology::MeetPoint(number)),
            };
            let index = self.read_index(info)?;
            let position = info.frame.center_of(lattice.cell(index));
            points.push(MeetPoint { kind, index, position, clearance_m: self.read_m()? });
        }
        Ok(points)
    }
}

/// The two regions that all steps of a portal lead between, the smaller index first; `None` if they
/// differ, or there is no step.
fn sides(partition: &Partition, portal: &[Crossing]) -> Option<[RegionIndex; 2]> {
    let of_step = |step: &Crossing| {
        let (left, right) = (partition.region_at(step.left)?, partition.region_at(step.right)?);
        (left != right).then(|| [left.min(right), left.max(right)])
    };
    let first = of_step(portal.first()?)?;
    portal.iter().all(|step| of_step(step) == Some(first)).then_some(first)
}
