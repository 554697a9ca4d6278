//! One exploration, event by event, and what is known at its end.

use anyhow::Context;
use meetpoint_sim::{NxDrive, NxExplored, nx_worlds};

use super::trail::Trail;

/// Tells of an exploration as it goes.
pub(super) fn tell(name: &str, drive: NxDrive) -> anyhow::Result<()> {
    let worlds = nx_worlds();
    let names = || worlds.iter().map(|world| world.name).collect::<Vec<_>>().join(", ");
    let world = worlds.iter().find(|world| world.name == name);
    let world = world.with_context(|| format!("`{name}` is none of: {}", names()))?;
    let (mut told, mut n_marked) = (None, 0);
    let mut trail = Trail::new(&world.building);
    let run = drive.explore(world, |explorer, truth, _| {
        let (n_places, n_edges) =
            (explorer.graph().map().n_places(), explorer.graph().edges().len());
        let now = (explorer.state(), n_places, n_edges, explorer.n_rehearsals());
        trail.pass(truth.position());
        if n_marked < n_places {
            trail.mark(truth.position(), n_marked);
            n_marked = n_places;
        }
        if told != Some(now) {
            told = Some(now);
            let (x_m, y_m) = (truth.x_m, truth.y_m);
            println!(
                "({x_m:.1} m, {y_m:.1} m) {:?}: {n_places} places, {n_edges} edges; {:?}",
                explorer.state(),
                explorer.whereabouts()
            );
        }
    });
    println!("{}", trail.draw());
    known(&run);
    Ok(())
}

/// What is known at the end.
fn known(run: &NxExplored) {
    let graph = run.explored.explorer.graph();
    for (id, _) in graph.map().places() {
        let Some(known) = graph.place(id) else { continue };
        let direction = |of: &meetpoint_places::qualitative::OpenDirection| {
            format!("{:.0}° {:?}", of.heading_rad.to_degrees(), of.control_law)
        };
        let directions: Vec<String> = known.seen.directions.iter().map(direction).collect();
        println!(
            "P{} {:?}, {} visits, by dead reckoning at {:.1}: {}",
            id.0,
            known.seen.goal,
            known.n_visits,
            known.seen.position,
            directions.join(", ")
        );
    }
    for edge in graph.edges() {
        let [from, to] = edge.ends;
        println!(
            "P{}.{} to P{}.{}: {:?}, {:.1} m long, {:.1} m wide, turned {:.2} rad, {} times",
            from.place.0,
            from.index,
            to.place.0,
            to.index,
            edge.strategy,
            edge.length_m.mean,
            edge.width_m.mean,
            edge.turned_rad.mean,
            edge.length_m.n
        );
    }
    println!(
        "complete: {}, isomorphic to the true graph: {}; {} rehearsals, {} refuted, {} surprises",
        run.explored.is_complete,
        run.is_true,
        run.explored.explorer.n_rehearsals(),
        run.explored.explorer.n_refuted(),
        run.explored.explorer.n_surprises()
    );
}
