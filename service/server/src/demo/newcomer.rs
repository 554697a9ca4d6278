//! The last robot of the demo: nobody knows where it starts, until the service finds out.

use anyhow::Context;
use meetpoint_client::{Client, v1};

use super::MAP;
use super::delivery::{self, LOOK_INTERVAL};
use super::drives::SimulatedDrive;

/// Has a robot drive whose start nobody knows, and the service find it: its session.
pub(super) async fn merged(client: &Client, drive: &SimulatedDrive) -> anyhow::Result<v1::Session> {
    println!(
        "\n{} is switched on somewhere, and does not know where. It drives {:.0} m:",
        drive.robot, drive.length_m
    );
    let sessions = delivery::deliver_all(client, MAP, std::slice::from_ref(drive)).await?;
    let session = sessions.into_iter().next().context("a drive has a session")?;
    println!("it has drawn a map of its own. Where in the other robots' map does that lie?\n");
    let kind = v1::JobKind::Merge.into();
    let request = v1::CreateJobRequest { map: MAP.to_owned(), kind, ..Default::default() };
    let mut job = client.create_job(request).await?;
    while !job.done {
        tokio::time::sleep(LOOK_INTERVAL).await;
        job = client.job(&job.id).await?;
    }
    let merges = client.merges(MAP, &session.id).await?;
    let merge = merges.first().context("the merge job has looked at nothing")?;
    let reasons = merge.reasons.join("; ");
    let verdict = merge.verdict().as_str_name().trim_start_matches("MERGE_VERDICT_");
    println!("  {verdict}: {reasons}");
    let session = client.session(&session.id).await?;
    match session.map_from_session {
        Some(v1::Pose { x_m, y_m, theta_rad }) => {
            let turn_deg = theta_rad.to_degrees();
            println!("  it started at ({x_m:.2}, {y_m:.2}), turned by {turn_deg:.0}°");
            let truth = drive.map_from_start;
            let off_m = (truth.x_m - x_m).hypot(truth.y_m - y_m);
            println!(
                "  which is {off_m:.2} m from the truth; version {} has all three",
                job.result_version
            );
        }
        None => println!("  nobody knows still: meetpoint merges show {}", merge.id),
    }
    Ok(session)
}
