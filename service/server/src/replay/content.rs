//! What a recording holds, whatever its format.

use std::{
    io,
    path::{Path, PathBuf},
    sync::Arc,
};

use meetpoint_client::v1;

use super::{
    account::Account,
    batches::Batches,
    cutter::CutBatch,
    lines,
    mrclam::{Run, RunBatches},
    section::Section,
    survey::{self, Survey},
};

/// A recording that was read once.
#[derive(Clone, Debug)]
pub(crate) enum Content {
    /// A CARMEN log, which is read again to be sent.
    Log {
        /// The file.
        path: PathBuf,
        /// What the first pass found in it.
        survey: Arc<Survey>,
    },
    /// A robot's run of an MRCLAM folder, in memory.
    Run(Arc<Run>),
}

impl Content {
    /// Reads a CARMEN log.
    ///
    /// # Errors
    ///
    /// If it cannot be opened.
    pub(crate) fn log(path: &Path) -> io::Result<Self> {
        let survey = Arc::new(survey::survey(lines::open(path)?));
        Ok(Self::Log { path: path.to_owned(), survey })
    }

    /// For people.
    pub(crate) fn account(&self) -> &Account {
        match self {
            Self::Log { survey, .. } => &survey.account,
            Self::Run(run) => &run.account,
        }
    }

    /// What its session declares.
    pub(crate) fn sensors(&self) -> Vec<v1::Sensor> {
        match self {
            Self::Log { survey, .. } => {
                survey.lasers.iter().map(|laser| laser.sensor.clone()).collect()
            }
            Self::Run(run) => vec![run.sensor.clone()],
        }
    }

    /// The batches of a part, in order.
    ///
    /// # Errors
    ///
    /// If a file cannot be opened any more.
    pub(crate) fn batches(
        &self,
        section: Section,
    ) -> io::Result<Box<dyn Iterator<Item = io::Result<CutBatch>> + '_>> {
        Ok(match self {
            Self::Log { path, survey } => {
                Box::new(Batches::new(lines::open(path)?, survey, section))
            }
            Self::Run(run) => Box::new(RunBatches::new(run, section).map(Ok)),
        })
    }
}
