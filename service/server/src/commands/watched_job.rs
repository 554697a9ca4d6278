//! A job that a command waits for, with its progress meanwhile.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use meetpoint_client::Client;
use meetpoint_proto::v1;

/// How often the job is asked for.
const POLL: Duration = Duration::from_millis(300);
/// Steps of the progress bar.
const N_STEPS: u32 = 1000;

/// The job once it has ended, however it did, with a bar called `name` meanwhile.
pub(super) async fn ended(
    client: &Client,
    mut job: v1::Job,
    name: &str,
    is_quiet: bool,
) -> anyhow::Result<v1::Job> {
    let bar = if is_quiet { ProgressBar::hidden() } else { ProgressBar::new(N_STEPS.into()) };
    let template = format!("{name} {{bar:40}} {{percent}} % {{elapsed}} {{msg}}");
    bar.set_style(ProgressStyle::with_template(&template)?);
    while !job.done {
        tokio::time::sleep(POLL).await;
        job = client.job(&job.id).await?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 1000")]
        bar.set_position((job.progress * f64::from(N_STEPS)) as u64);
        if let Some(line) = job.log.last() {
            bar.set_message(line.text.clone());
        }
    }
    bar.finish_and_clear();
    Ok(job)
}

/// Nothing, if the job has done what it was to do.
///
/// # Errors
/// Why it has not.
pub(super) fn has_succeeded(job: &v1::Job) -> anyhow::Result<()> {
    if let Some(v1::JobError { code, message }) = &job.error {
        anyhow::bail!("the job failed: {message} ({code})");
    }
    anyhow::ensure!(job.state == i32::from(v1::JobState::Succeeded), "the job was cancelled");
    Ok(())
}

/// Tells which job was started, for whoever does not wait.
pub(super) fn tell_started(job: &v1::Job, is_json: bool) {
    if is_json {
        println!("{}", serde_json::json!({ "job": job.id }));
    } else {
        println!("job {}", job.id);
    }
}
