//! `meetpoint relax`: starts the job, shows its progress and the likelihood as it climbs, waits.

use std::collections::BTreeMap;

use meetpoint_proto::v1;
use v1::create_job_request::Params;
use v1::job_log_line::Figures;

use super::asked::ServerArgs;
use super::likelihood_curve::curve;
use super::watched_job::{ended, has_succeeded, tell_started};

/// Characters that a likelihood curve is wide at most.
const N_COLUMNS: usize = 60;

/// Options of `meetpoint relax`.
#[derive(Debug, clap::Args)]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag of the command line")]
pub struct RelaxArgs {
    /// The map
    #[arg(long, value_name = "MAP")]
    map: String,
    /// Relax only this session of it; may be given more than once
    #[arg(long = "session", value_name = "ID")]
    sessions: Vec<String>,
    /// Take landmarks of one type for all alike, whatever sightings call them
    #[arg(long)]
    forget_identities: bool,
    /// Believe the odometry to be right on average
    #[arg(long)]
    keep_odometry: bool,
    /// Relax sessions with a laser by junctions, corners and dead ends of their own grids
    #[arg(long)]
    landmarks_from_grid: bool,
    /// Go on from what the newest relaxation found: only where something is new, and much cheaper
    #[arg(long)]
    going_on: bool,
    /// Higher goes before other jobs: -100 to 100
    #[arg(long, default_value_t = 0, allow_negative_numbers = true)]
    priority: i32,
    /// Start the job and do not wait
    #[arg(long)]
    detach: bool,
    #[command(flatten)]
    server: ServerArgs,
}

/// Runs the job to its end.
///
/// # Errors
/// If it could not be started, failed, or was cancelled.
pub async fn run(args: RelaxArgs) -> anyhow::Result<()> {
    let client = args.server.client()?;
    let params = v1::RelaxParams {
        sessions: args.sessions,
        forget_identities: args.forget_identities,
        estimate_odometry: Some(!args.keep_odometry),
        landmarks_from_grid: args.landmarks_from_grid,
        going_on: args.going_on,
    };
    let request = v1::CreateJobRequest {
        map: args.map,
        kind: v1::JobKind::Relax.into(),
        priority: args.priority,
        params: Some(Params::Relax(params)),
    };
    let job = client.create_job(request).await?;
    if args.detach {
        tell_started(&job, args.server.json);
        return Ok(());
    }
    let job = ended(&client, job, "relax", args.server.json).await?;
    let likelihoods = likelihoods(&job.log);
    has_succeeded(&job)?;
    if args.server.json {
        println!("{}", json(&job, &likelihoods));
    } else {
        print(&job, &likelihoods);
    }
    Ok(())
}

/// The likelihood after each iteration, by session and stage in the order of their names.
type Likelihoods = BTreeMap<(String, String), Vec<f64>>;

fn likelihoods(log: &[v1::JobLogLine]) -> Likelihoods {
    let mut found = Likelihoods::new();
    for line in log {
        let Some(Figures::Relax(figures)) = &line.figures else { continue };
        let Some(log_likelihood) = figures.log_likelihood else { continue };
        let place = (figures.session.clone(), figures.stage.clone());
        found.entry(place).or_default().push(log_likelihood);
    }
    found
}

fn print(job: &v1::Job, likelihoods: &Likelihoods) {
    for ((session, stage), values) in likelihoods {
        let (first, last) = (values.first(), values.last());
        if let (Some(first), Some(last)) = (first, last) {
            println!("session {session}, {stage}: log-likelihood {first:.1} to {last:.1}");
            println!("  {}", curve(values, N_COLUMNS));
        }
    }
    println!("map {} is version {} now", job.map, job.result_version);
    for found in sessions(job) {
        if let Some(scans) = &found.scans {
            print_scans(&found.session, scans, found.correction_max_m);
        }
        if found.scans.is_some() && found.sightings == 0 {
            continue;
        }
        println!(
            "session {}: {} landmarks in {} sightings at {} stations, confidence {:.3}",
            found.session, found.landmarks, found.sightings, found.steps, found.confidence
        );
        println!(
            "  sightings of one landmark lie {:.2} m apart, {:.2} m before; poses moved by up to {:.2} m",
            found.spread_after_m, found.spread_before_m, found.correction_max_m
        );
        if let Some(odometry) = &found.calibration {
            println!(
                "  odometry: a metre is {:.4} m, it drifts {:+.4} rad/m and {:+.4} rad/rad",
                odometry.scale, odometry.turn_per_m, odometry.turn_per_rad
            );
        }
        for other in &found.alternatives {
            println!("  or, e^{:.1} times as probable: {}", other.log_odds, other.decided_by);
        }
    }
}

fn print_scans(session: &str, scans: &v1::ScanRelaxation, moved_m: f64) {
    let (before, after) = (scans.before.unwrap_or_default(), scans.after.unwrap_or_default());
    println!(
        "session {session}: {} closures accepted and {} refused among {} scans; poses moved by up to {moved_m:.2} m",
        scans.closures_accepted, scans.closures_refused, scans.scans
    );
    println!(
        "  sharpness: {:.0} bits, {:.4} a cell; before {:.0} bits, {:.4} a cell; chi2 {:.0}, before {:.0}",
        after.entropy_bits,
        after.entropy_mean_bits,
        before.entropy_bits,
        before.entropy_mean_bits,
        scans.chi2_after,
        scans.chi2_before
    );
    if let Some(v1::Pose { x_m, y_m, theta_rad }) = scans.lasers_moved {
        println!(
            "  lasers, against where they are declared: {x_m:+.3} m ahead, {y_m:+.3} m to the left, \
             {:+.2} degrees",
            theta_rad.to_degrees()
        );
    }
    let n_sightings = scans.sightings_in_graph + scans.sightings_fitted_only;
    if 0 < n_sightings {
        println!(
            "  landmarks: {} of {n_sightings} sightings in the graph, {} doubted",
            scans.sightings_in_graph, scans.sightings_doubted
        );
    }
}

fn sessions(job: &v1::Job) -> &[v1::RelaxedSession] {
    match &job.result {
        Some(v1::job::Result::RelaxResult(result)) => &result.sessions,
        _ => &[],
    }
}

fn scans_json(scans: &v1::ScanRelaxation) -> serde_json::Value {
    let sharpness = |of: Option<v1::GridSharpness>| {
        let v1::GridSharpness { cells, entropy_bits, entropy_mean_bits } = of.unwrap_or_default();
        serde_json::json!({
            "cells": cells,
            "entropy_bits": entropy_bits,
            "entropy_mean_bits": entropy_mean_bits,
        })
    };
    serde_json::json!({
        "scans": scans.scans,
        "closures_accepted": scans.closures_accepted,
        "closures_refused": scans.closures_refused,
        "chi2_before": scans.chi2_before,
        "chi2_after": scans.chi2_after,
        "before": sharpness(scans.before),
        "after": sharpness(scans.after),
        "sightings_in_graph": scans.sightings_in_graph,
        "sightings_fitted_only": scans.sightings_fitted_only,
        "sightings_doubted": scans.sightings_doubted,
        "lasers_moved": scans.lasers_moved.map(|moved| {
            let v1::Pose { x_m, y_m, theta_rad } = moved;
            serde_json::json!({ "x_m": x_m, "y_m": y_m, "theta_rad": theta_rad })
        }),
    })
}

fn json(job: &v1::Job, likelihoods: &Likelihoods) -> serde_json::Value {
    let session = |found: &v1::RelaxedSession| {
        let own = likelihoods.iter().filter(|((session, _), _)| *session == found.session);
        let curves: Vec<_> = own
            .map(|((_, stage), values)| serde_json::json!({ "stage": stage, "values": values }))
            .collect();
        let alternative = |other: &v1::RelaxAlternative| serde_json::json!({ "log_odds": other.log_odds, "decided_by": other.decided_by });
        let alternatives: Vec<_> = found.alternatives.iter().map(alternative).collect();
        let odometry = found.calibration.unwrap_or_default();
        serde_json::json!({
            "session": found.session,
            "landmarks": found.landmarks,
            "sightings": found.sightings,
            "steps": found.steps,
            "log_likelihood": found.log_likelihood,
            "confidence": found.confidence,
            "spread_before_m": found.spread_before_m,
            "spread_after_m": found.spread_after_m,
            "correction_max_m": found.correction_max_m,
            "calibration": {
                "scale": odometry.scale,
                "turn_per_m": odometry.turn_per_m,
                "turn_per_rad": odometry.turn_per_rad,
            },
            "alternatives": alternatives,
            "scans": found.scans.as_ref().map(scans_json),
            "log_likelihoods": curves,
        })
    };
    let sessions: Vec<_> = sessions(job).iter().map(session).collect();
    serde_json::json!({
        "job": job.id,
        "map": job.map,
        "map_version": job.result_version,
        "sessions": sessions,
    })
}
