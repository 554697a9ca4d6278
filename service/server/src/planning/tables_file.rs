//! Plan tables as a file. Its format is told where it is read: `clients/rust/src/plan_tables.rs`.

use meetpoint_planning::Plans;
use meetpoint_proto::v1;
use prost::Message;

use super::field::Field;

/// What a file begins with: name and number of the format.
const MAGIC: &[u8; 8] = b"MPPLANS\x01";

/// The file of a field's tables, in pieces of about `piece_bytes`.
pub(crate) fn file(
    field: &Field,
    plans: &Plans,
    basis: v1::PlanBasis,
    piece_bytes: usize,
) -> Vec<Vec<u8>> {
    let mut pieces = Pieces { done: vec![], open: MAGIC.to_vec(), piece_bytes };
    let header = header(field, plans, basis).encode_to_vec();
    pieces.put(&u32::try_from(header.len()).unwrap_or(u32::MAX).to_le_bytes());
    pieces.put(&header);
    let n_cells = field.info().n_cells();
    let weights: Vec<u8> = (0..n_cells).map(|cell| field.space.weight(cell)).collect();
    pieces.put(&weights);
    let mut run: Option<(u64, u64)> = None;
    for cell in 0..n_cells {
        let region =
            field.ground.partition.region_at(cell).map_or(0, |region| u64::from(region.0) + 1);
        match &mut run {
            Some((value, length)) if *value == region => *length += 1,
            _ => {
                put_run(&mut pieces, run.replace((region, 1)));
            }
        }
    }
    put_run(&mut pieces, run);
    for region in 0..plans.n_regions() {
        for (place, gate) in plans.region_gates(region).enumerate() {
            for node in 0..plans.n_gate_nodes(gate) {
                let mut before = 0_i64;
                let cells = plans.region_cells(region);
                let costs = plans.region_costs(region, place, node).zip(cells);
                // Tables keep costs of cells that were closed since, too.
                for (cost, _) in costs.filter(|(_, cell)| 0 < weights[**cell as usize]) {
                    pieces.put_signed(i64::from(cost) - before);
                    before = i64::from(cost);
                }
            }
        }
    }
    pieces.done.push(pieces.open);
    pieces.done
}

fn put_run(pieces: &mut Pieces, run: Option<(u64, u64)>) {
    if let Some((value, length)) = run {
        pieces.put_unsigned(value);
        pieces.put_unsigned(length);
    }
}

fn header(field: &Field, plans: &Plans, basis: v1::PlanBasis) -> v1::PlanTablesHeader {
    let (info, ids) = (field.info(), field.ground.topology.ids());
    let gate = |gate: meetpoint_planning::GateView, arcs: &[usize]| {
        let [inner, outer] = gate.regions.map(|region| region.0);
        v1::PlanGate {
            inner,
            outer,
            toll: gate.toll,
            arc: arcs.first().map_or(0, |&place| field.ground.arc_id(place)),
            nodes: gate.nodes.iter().map(|node| node.cell as u64).collect(),
            across: gate.nodes.iter().map(|node| node.across).collect(),
        }
    };
    let gates = plans
        .gates()
        .zip(0..)
        .map(|(view, place)| gate(view, plans.arcs(meetpoint_planning::GateIndex(place))));
    v1::PlanTablesHeader {
        basis: Some(basis),
        resolution_m: info.frame.resolution_m(),
        first_x: info.first.x,
        first_y: info.first.y,
        width: info.width,
        height: info.height,
        regions: ids.regions.iter().map(|id| id.0).collect(),
        gates: gates.collect(),
    }
}

/// Bytes, a piece at a time.
struct Pieces {
    done: Vec<Vec<u8>>,
    open: Vec<u8>,
    piece_bytes: usize,
}

impl Pieces {
    fn put(&mut self, bytes: &[u8]) {
        for piece in bytes.chunks(self.piece_bytes.max(1)) {
            if self.piece_bytes < self.open.len() + piece.len() {
                self.done.push(std::mem::take(&mut self.open));
            }
            self.open.extend_from_slice(piece);
        }
    }

    /// Seven bits a byte, the lowest first; the highest bit says that more follow.
    fn put_unsigned(&mut self, mut value: u64) {
        loop {
            let low = u8::try_from(value & 0x7f).unwrap_or(0);
            value >>= 7;
            if value == 0 {
                return self.put(&[low]);
            }
            self.put(&[low | 0x80]);
        }
    }

    /// Small numbers of either sign are small: 0, -1, 1, -2...
    fn put_signed(&mut self, value: i64) {
        self.put_unsigned((value << 1 ^ value >> 63).cast_unsigned());
    }
}
