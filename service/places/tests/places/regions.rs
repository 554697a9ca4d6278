//! Boundary regions on drawn floors, and their definition.

use meetpoint_places::{BoundaryRegions, Gateway, PlaceId, PlaceMap, World, boundary_regions};
use meetpoint_sim::ChaCha8Rng;
use rand::SeedableRng;

/// What lies on the sides of the path that is listed as these places, as names.
fn told(drawing: &str, path: &str) -> [String; 3] {
    let world = World::from_drawing(drawing).expect("a drawing");
    let name = |place: &PlaceId| world.name(*place).expect("a name");
    let names = |places: &[PlaceId]| places.iter().map(name).collect::<String>();
    let regions = boundary_regions(world.map());
    let paths = world.map().paths();
    let known: Vec<String> = paths.iter().map(|path| names(path)).collect();
    let (at, is_turned) = known
        .iter()
        .enumerate()
        .find_map(|(at, known)| {
            let back: String = known.chars().rev().collect();
            (known == path).then_some((at, false)).or((back == path).then_some((at, true)))
        })
        .unwrap_or_else(|| panic!("no path {path}: {known:?}"));
    let BoundaryRegions { right, left, around } = &regions[at];
    let (right, left) = if is_turned { (left, right) } else { (right, left) };
    [right, left, around].map(|places| names(places))
}

/// Figure 1 (a): east along the street that C, B and A are on, all else is to the right, but for what is up north.
#[test]
fn figure_1a() {
    let floor = "
                W
                |
            C---B---A---X
            |   |   |
            |   Z   |
            |       |
        Y---D-------E";
    assert_eq!(told(floor, "CBAX"), ["ZYDE", "W", ""], "east");
}

#[test]
fn a_street_parts_a_grid_of_blocks() {
    let floor = "
            A---B---C
            |   |   |
        P---D---E---F---Q
            |   |   |
            G---H---I";
    assert_eq!(told(floor, "PDEFQ"), ["GHI", "ABC", ""], "east along the middle street");
    assert_eq!(told(floor, "QFEDP"), ["ABC", "GHI", ""], "and west");
    assert_eq!(told(floor, "BEH"), ["APDG", "CFQI", ""], "south along the one across");
}

#[test]
fn who_walks_around_the_end_of_a_path_is_on_neither_side() {
    let floor = "
        A---B---C
        |   |   |
        |   X   |
        |       |
        D-------E";
    // The blind alley BX parts nothing: it is not passed anywhere.
    assert_eq!(told(floor, "BX"), ["", "", ""], "no sides");
    let through = "
        A-------B
        |       |
        |   Y   |
        |   |   |
        C---M---D
        |   |   |
        |   X   |
        |       |
        E-------F";
    assert_eq!(told(through, "YMX"), ["", "", "ABCDEF"], "around both of its ends");
}

/// The definition: every walk that never comes back to a place.
fn walks(
    map: &PlaceMap,
    path: &[PlaceId],
    walk: &mut Vec<PlaceId>,
    from: Gateway,
    met: &mut Vec<PlaceId>,
) {
    let Some(to) = map.leads_to(from) else { return };
    if path.contains(&to.place) || walk.contains(&to.place) {
        return;
    }
    walk.push(to.place);
    met.push(to.place);
    for gateway in map.gateways().filter(|gateway| gateway.place == to.place) {
        walks(map, path, walk, gateway, met);
    }
    walk.pop();
}

/// Gateways of a place, clockwise from one to another, without both.
fn between(n_gateways: u8, from: u8, to: u8) -> Vec<u8> {
    let onward = (1..n_gateways).map(|turn| (from + turn) % n_gateways);
    onward.take_while(|&gateway| gateway != to).collect()
}

#[test]
fn regions_are_as_walks_find_them() {
    let mut n_parted = 0;
    for seed in 0..30 {
        let drawing = meetpoint_sim::nested_loops(&mut ChaCha8Rng::seed_from_u64(seed));
        let world = World::from_drawing(&drawing).expect("a drawing");
        let map = world.map();
        for (path, found) in map.passes().iter().zip(boundary_regions(map)) {
            let own: Vec<PlaceId> = path.iter().map(|pass| pass.place).collect();
            let (mut right, mut left) = (Vec::new(), Vec::new());
            for pass in path {
                let (Some(enters), Some(leaves)) = (pass.enters, pass.leaves) else { continue };
                let n = map.place(pass.place).expect("a place").star.n_gateways();
                for (side, [from, to]) in
                    [(&mut right, [leaves, enters]), (&mut left, [enters, leaves])]
                {
                    for index in between(n, from, to) {
                        let gateway = Gateway { place: pass.place, index };
                        walks(map, &own, &mut Vec::new(), gateway, side);
                    }
                }
            }
            let of = |on_right: bool, on_left: bool| {
                let ids = map.places().map(|(id, _)| id);
                let is_of =
                    |id: &PlaceId| right.contains(id) == on_right && left.contains(id) == on_left;
                ids.filter(is_of).collect::<Vec<_>>()
            };
            let expected = BoundaryRegions {
                right: of(true, false),
                left: of(false, true),
                around: of(true, true),
            };
            assert_eq!(found, expected, "seed {seed}, path {own:?}:\n{drawing}");
            n_parted += usize::from(!found.right.is_empty() && !found.left.is_empty());
        }
    }
    assert!(10 < n_parted, "paths that part floors: {n_parted}");
}
