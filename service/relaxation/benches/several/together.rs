//! Two travels past landmarks that look alike, in one frame: whether what each said by itself stays wrong,
//! and what one expectation maximisation over both makes of it.

use std::ops::ControlFlow;
use std::time::Instant;

use meetpoint_geometry::Pose;
use meetpoint_relaxation::{
    AlignmentParams, JointOutcome, Outcome, Placed, Relaxation, RelaxationParams, StartBelief,
    Started, Travel, joint, one_em,
};
use meetpoint_sim::{LandmarkTravel, first_data_set, museum, museum_again, second_data_set};

use crate::museum::cut;

const N_WORLDS: u64 = 6;
/// Seeds of second travels: others than those of the first.
const OTHER_SEEDS: u64 = 1000;
/// How surely a merged travel is taken to lie, and how far off it is put: metres and radians.
const MERGED: (f64, f64) = (0.5, 0.05);

/// Prints a row for each sort of pair.
pub(crate) fn print() {
    println!(
        "| two travels in one frame | wrong alone, of both | wrong together | wrong after one EM | \
         taken | pairs of sightings wrong: together, after | s of EM, most |"
    );
    println!("|---|---|---|---|---|---|---|");
    for n in [8, 15] {
        let name = format!("first data set, and its first {n} sightings again, starts told");
        row(&name, |seed| {
            (first_data_set(seed), first_data_set(seed + OTHER_SEEDS).until_sighting(n))
        });
    }
    row("second data set twice, starts told", |seed| {
        (second_data_set(seed), second_data_set(seed + OTHER_SEEDS))
    });
    row("museum and the second run, merged", |seed| (museum(seed), museum_again(seed)));
    for n in [6, 12] {
        let name = format!("museum and the first {n} sightings of the second run, merged");
        row(&name, |seed| (museum(seed), museum_again(seed).until_sighting(n)));
    }
}

fn row(name: &str, world: impl Fn(u64) -> (LandmarkTravel, LandmarkTravel)) {
    let (mut n_alone, mut n_before, mut n_after, mut n_taken) = (0, 0, 0, 0);
    let (mut pairs, mut most_s) = ((0, 0), 0.0_f64);
    for seed in 0..N_WORLDS {
        let (first, second) = world(seed);
        let site_from_second = first.moments[0].truth.step_to(second.moments[0].truth);
        let is_told = site_from_second.distance_m() < 1e-9;
        let truths = [sighted(&first), sighted(&second)];
        let travels = [cut(&first).0, cut(&second).0];
        let outcomes = [relaxed(&travels[0]), relaxed(&travels[1])];
        let alone = outcomes.iter().zip(&truths);
        let alone = alone.map(|(it, truth)| n_wrong_pairs(&it.association, truth)).sum::<usize>();
        let off = Pose::new(MERGED.0, -MERGED.0, MERGED.1);
        let begins =
            [Pose::IDENTITY, if is_told { site_from_second } else { site_from_second * off }];
        let started: Vec<Started<'_>> = (0..2)
            .map(|index| Started {
                placed: Placed {
                    travel: &travels[index],
                    outcome: &outcomes[index],
                    site_from_travel: begins[index],
                },
                start: if index == 0 || is_told {
                    StartBelief::At(begins[index])
                } else {
                    let (m2, rad2) = (MERGED.0 * MERGED.0, MERGED.1 * MERGED.1);
                    let covariance = [[m2, 0.0, 0.0], [0.0, m2, 0.0], [0.0, 0.0, rad2]];
                    StartBelief::About { pose: begins[index], covariance }
                },
            })
            .collect();
        let placed: Vec<Placed<'_>> = started.iter().map(|it| it.placed).collect();
        let before = joint(&placed, &AlignmentParams::of_travels(&travels)).expect("it fits");
        let truth: Vec<usize> = truths.concat();
        let wrong_before = n_wrong_pairs(&association(&travels, &before), &truth);
        let begun = Instant::now();
        let ControlFlow::Continue(Some(after)) =
            one_em(&started, before, |_| ControlFlow::Continue(()))
        else {
            panic!("it fits")
        };
        most_s = most_s.max(begun.elapsed().as_secs_f64());
        let wrong_after = n_wrong_pairs(&association(&travels, &after.outcome), &truth);
        n_alone += usize::from(0 < alone);
        n_before += usize::from(0 < wrong_before);
        n_after += usize::from(0 < wrong_after);
        n_taken += usize::from(0 < after.n_told_otherwise);
        pairs = (pairs.0 + wrong_before, pairs.1 + wrong_after);
    }
    println!(
        "| {name} | {n_alone} of {N_WORLDS} | {n_before} | {n_after} | {n_taken} | {}, {} | {most_s:.2} |",
        pairs.0, pairs.1
    );
}

fn relaxed(travel: &Travel) -> Outcome {
    let mut relaxation = Relaxation::new(travel, RelaxationParams::of(travel));
    while !relaxation.advance().is_done {}
    relaxation.outcome().cloned().expect("landmarks were seen")
}

/// Which landmark each sighting truly saw.
fn sighted(travel: &LandmarkTravel) -> Vec<usize> {
    let sightings = travel.moments.iter().flat_map(|moment| &moment.sightings);
    sightings.map(|seen| seen.landmark).collect()
}

/// Which landmark each sighting of both was taken for.
fn association(travels: &[Travel; 2], outcome: &JointOutcome) -> Vec<Option<u32>> {
    let mut all = Vec::new();
    for (index, travel) in travels.iter().enumerate() {
        for (step, at) in travel.steps.iter().enumerate() {
            for within in 0..at.sightings.len() {
                let sighting = (index, step, within);
                let landmarks = (0_u32..).zip(&outcome.landmarks);
                let of = landmarks.filter(|(_, it)| it.sightings.contains(&sighting));
                all.push(of.map(|(number, _)| number).next());
            }
        }
    }
    all
}

/// Pairs of sightings that are taken for one landmark and are of two, or the other way round.
fn n_wrong_pairs(association: &[Option<u32>], truth: &[usize]) -> usize {
    let all: Vec<_> = association.iter().zip(truth).collect();
    let pairs =
        all.iter().enumerate().flat_map(|(index, a)| all[..index].iter().map(move |b| (a, b)));
    pairs.filter(|(a, b)| (a.0.is_some() && a.0 == b.0) != (a.1 == b.1)).count()
}
