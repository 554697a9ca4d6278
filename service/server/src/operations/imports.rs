//! Imports of maps that were made elsewhere.

use std::future::Future;
use std::time::Duration;

use meetpoint_proto::v1;
use meetpoint_storage::{ContentHash, JournalSeq, MapId, NewImport, NewMap};
use prost::Message;
use tokio::sync::OwnedSemaphorePermit;

use crate::convert::{import, map, slug};
use crate::live::Event;
use crate::{clock, error::Error, service::Service};

/// Imports under way at the same time; more wait. One of the largest size takes some 300 MB.
pub(crate) const N_AT_ONCE: usize = 2;
/// A sender that takes longer makes room for others: 64 MB at 5 Mbit/s.
const SENDING_MAX: Duration = Duration::from_mins(2);
/// So long an answer waits for the version, which is less than clients wait for an answer.
const VERSION_WAIT: Duration = Duration::from_secs(20);
/// Bytes of a YAML; real ones have 200.
pub(crate) const YAML_BYTES_MAX: usize = 65536;

/// The right to be one of the few imports under way. Held while files are collected.
pub(crate) struct ImportSlot {
    permit: OwnedSemaphorePermit,
}

impl Service {
    /// Waits until another import may be under way.
    pub(crate) async fn import_slot(&self) -> Result<ImportSlot, Error> {
        let permit = self.importing.clone().acquire_owned().await;
        permit.map(|permit| ImportSlot { permit }).map_err(|_| Error::Stopping)
    }

    /// Checks that so many bytes of files may be taken.
    pub(crate) fn check_import_bytes(&self, n_bytes: usize) -> Result<(), Error> {
        let limit_bytes = self.settings.limits.import_bytes_max;
        if n_bytes <= limit_bytes {
            return Ok(());
        }
        Err(Error::MessageTooLarge { n_bytes, limit_bytes })
    }

    /// Records a map's files and waits for the version that they become.
    pub(crate) async fn import_map(
        &self,
        slot: ImportSlot,
        id: &str,
        files: v1::MapServerFiles,
    ) -> Result<v1::ImportMapResponse, Error> {
        let id = MapId(slug::slug("map", id)?);
        if YAML_BYTES_MAX < files.yaml.len() {
            let problem = format!("{} bytes, at most {YAML_BYTES_MAX}", files.yaml.len());
            return Err(Error::field("yaml", problem));
        }
        self.check_import_bytes(files.yaml.len() + files.image.len())?;
        let n_cells_max = self.settings.limits.import_cells_max;
        let read = tokio::task::spawn_blocking(move || checked(&files, id, n_cells_max));
        let (new, cells, warnings) = read.await.map_err(Error::internal)??;
        let recorded = self.store.import_map(&new).await?;
        // What follows takes no memory.
        drop((new, slot.permit));
        let id = recorded.map.id;
        if recorded.is_new {
            self.actors.wake(&id);
        }
        let waiting = tokio::time::timeout(VERSION_WAIT, self.version_with(&id, recorded.seq));
        let map_version = waiting.await.unwrap_or(Ok(0))?;
        Ok(v1::ImportMapResponse {
            map: Some(map::to_wire(self.map_record(&id.0).await?)),
            map_version,
            journal_position: u64::try_from(recorded.seq.0).unwrap_or(0),
            already_imported: !recorded.is_new,
            cells: Some(cells),
            warnings,
        })
    }

    /// The first version of a map that tells what stands at a place of its journal, once it is made.
    async fn version_with(&self, map: &MapId, seq: JournalSeq) -> Result<u64, Error> {
        let mut events = self.live.watch();
        loop {
            if let Some(number) = self.store.first_version_with(map, seq).await? {
                return Ok(number);
            }
            let announced = async {
                // Whoever falls behind looks again.
                while let Ok((of, event)) = events.recv().await {
                    if of == *map && matches!(event, Event::Version(_)) {
                        return;
                    }
                }
            };
            tokio::select! {
                () = announced => {}
                () = self.stop.cancelled() => return Err(Error::Stopping),
            }
        }
    }
}

/// What collecting files gives, unless it takes too long.
pub(crate) async fn in_time<T, E: From<Error>>(
    collecting: impl Future<Output = Result<T, E>>,
) -> Result<T, E> {
    let seconds = SENDING_MAX.as_secs();
    let late = |_| Error::field("image", format!("did not arrive within {seconds} s"));
    tokio::time::timeout(SENDING_MAX, collecting).await.map_err(late)?
}

/// The files as an entry of the journal, what they make of the map, and what to say of them.
fn checked(
    files: &v1::MapServerFiles,
    id: MapId,
    n_cells_max: u64,
) -> Result<(NewImport, v1::ImportedCells, Vec<String>), Error> {
    let (yaml, map) = import::received(files, n_cells_max)?;
    let payload = files.encode_to_vec();
    let new = NewImport {
        map: NewMap {
            id,
            display_name: String::new(),
            resolution_m: yaml.resolution_m,
            time_ns: clock::now_ns(),
        },
        content_hash: ContentHash(*blake3::hash(&payload).as_bytes()),
        payload,
    };
    Ok((new, import::cells_to_wire(&map), map.warnings))
}
