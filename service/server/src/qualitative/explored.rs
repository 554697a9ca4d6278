//! What the journal says of one session's exploration: its firings, what people decided, and what the
//! explorer makes of both.

use meetpoint_geometry::Pose;
use meetpoint_places::qualitative::{Explorer, Firing, Guide, GuideParams, Stop};
use meetpoint_proto::v1;
use meetpoint_storage::{BatchPayload, SessionId};
use meetpoint_tracking::{Odometry, Velocity};
use prost::Message;
use v1::observation::Kind;

use super::decision::{Begun, Decided, Decision};
use super::eye::Eye;
use crate::convert::{pose, sensor::DeclaredSensor};
use crate::error::Error;
use crate::hypotheses::{Moment, Visit};
use crate::settings::QualitativeSettings;

/// Label of the mark by which a robot tells that it sees that it is home.
pub(crate) const HOME: &str = "home";

/// A session's exploration as far as it was read.
pub(crate) struct Explored {
    session: SessionId,
    sensors: Vec<DeclaredSensor>,
    limits: QualitativeSettings,
    /// Batches up to this number are in.
    read_through: u64,
    n_batches_skipped: u64,
    /// In the order in which they hold.
    decisions: Vec<Decision>,
    /// Decisions that are in.
    n_applied: usize,
    begun: Begun,
    /// The batch after which it began.
    begun_after: u64,
    eye: Eye,
    guide: Guide,
    odometry: Odometry,
    sees_home: bool,
    stamp_ns: i64,
    n_left_out: u64,
    /// Of each stop of the explorer's itinerary: the batch and the stamp of the firing at which it ended.
    moments: Vec<Moment>,
}

impl Explored {
    /// Nothing yet.
    ///
    /// # Errors
    /// [`Error::NotAllAround`].
    pub(crate) fn new(
        session: SessionId,
        sensors: Vec<DeclaredSensor>,
        limits: &QualitativeSettings,
    ) -> Result<Self, Error> {
        let begun = Begun::DEFAULT;
        Ok(Self {
            session,
            eye: Eye::of(session, &sensors, &begun.sensor)?,
            guide: guide(&begun, limits),
            sensors,
            limits: limits.clone(),
            read_through: 0,
            n_batches_skipped: 0,
            decisions: Vec::new(),
            n_applied: 0,
            begun,
            begun_after: 0,
            odometry: Odometry::default(),
            sees_home: false,
            stamp_ns: 0,
            n_left_out: 0,
            moments: Vec::new(),
        })
    }

    /// Whose it is.
    pub(crate) fn session(&self) -> SessionId {
        self.session
    }

    /// Batches up to this number are in.
    pub(crate) fn read_through(&self) -> u64 {
        self.read_through
    }

    /// Batches that the session skipped since it began.
    pub(crate) fn n_batches_skipped(&self) -> u64 {
        self.n_batches_skipped
    }

    /// How it began, and the batch after which.
    pub(crate) fn begun(&self) -> (&Begun, u64) {
        (&self.begun, self.begun_after)
    }

    /// Its sensor.
    pub(crate) fn eye(&self) -> &Eye {
        &self.eye
    }

    /// The sensor of that name, or the first that will do.
    ///
    /// # Errors
    /// [`Error::NoSuchSensor`], [`Error::NotAllAround`].
    pub(crate) fn eye_of(&self, name: &str) -> Result<Eye, Error> {
        Eye::of(self.session, &self.sensors, name)
    }

    /// What guides it; `None` before its first firing.
    pub(crate) fn guide(&self) -> Option<&Guide> {
        (0 < self.guide.n_firings()).then_some(&self.guide)
    }

    /// Stamp of the newest firing that was taken in.
    pub(crate) fn stamp_ns(&self) -> i64 {
        self.stamp_ns
    }

    /// Where it arrived, as a travel of visits, and when.
    pub(crate) fn arrivals(&self) -> Vec<(Visit, Moment)> {
        let stops = self.guide.explorer().itinerary().stops();
        let arrival = |(number, (stop, &moment)): (u32, (&Stop, &Moment))| {
            let Stop { turn, seen, record } = stop.clone();
            (Visit { number, turn, seen, record }, moment)
        };
        (0_u32..).zip(stops.iter().zip(&self.moments)).map(arrival).collect()
    }

    /// Firings that were not.
    pub(crate) fn n_left_out(&self) -> u64 {
        self.n_left_out
    }

    /// Puts all decisions of the journal in place of those that were known. Begins again if one is of an earlier
    /// batch than was read.
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub(crate) fn set_decisions(&mut self, mut decisions: Vec<Decision>) -> Result<(), Error> {
        // Stable: of one batch in the order of the journal.
        decisions.sort_by_key(|decision| decision.after_batch);
        let n = self.n_applied;
        let is_on = decisions.get(..n) == Some(&self.decisions[..n])
            && decisions[n..].iter().all(|new| self.read_through <= new.after_batch);
        if !is_on {
            *self = Self::new(self.session, std::mem::take(&mut self.sensors), &self.limits)?;
        }
        self.decisions = decisions;
        Ok(())
    }

    /// Takes the firings of the next batch in.
    ///
    /// # Errors
    /// [`Error::Internal`] if the journal holds what ingest never lets through.
    pub(crate) fn read(&mut self, batch: &BatchPayload) -> Result<(), Error> {
        let BatchPayload { number, payload, rejected } = batch;
        let v1::Batch { number: _, observations } =
            v1::Batch::decode(payload.as_slice()).map_err(Error::internal)?;
        self.decide(number.saturating_sub(1))?;
        for (index, observation) in (0_u32..).zip(observations) {
            if !rejected.contains(&index) {
                self.take_in(*number, observation);
            }
        }
        self.n_batches_skipped += number.saturating_sub(self.read_through + 1);
        self.read_through = *number;
        Ok(())
    }

    /// Applies what was decided up to the newest batch.
    ///
    /// # Errors
    /// [`Error::Internal`] if the journal holds what was never decided.
    pub(crate) fn catch_up(&mut self) -> Result<(), Error> {
        self.decide(u64::MAX)
    }

    fn decide(&mut self, through: u64) -> Result<(), Error> {
        while let Some(decision) = self.decisions.get(self.n_applied) {
            if through < decision.after_batch {
                break;
            }
            let after_batch = decision.after_batch;
            match decision.decided.clone() {
                Decided::Begun(begun) => {
                    self.eye = self.eye_of(&begun.sensor)?;
                    self.guide = guide(&begun, &self.limits);
                    (self.begun, self.begun_after) = (begun, after_batch);
                    (self.n_left_out, self.n_batches_skipped) = (0, 0);
                    self.moments.clear();
                }
                Decided::Selected(selection) => {
                    self.begun.selection = selection;
                    self.guide.explorer_mut().select(selection);
                }
                Decided::Marked { place, is_home } => {
                    self.guide.explorer_mut().mark_home(place, is_home);
                }
            }
            self.n_applied += 1;
        }
        Ok(())
    }

    fn take_in(&mut self, batch: u64, observation: v1::Observation) {
        let v1::Observation { stamp_ns, monotonic_ns: _, sensor_id, kind } = observation;
        let ranges_m = match kind {
            Some(Kind::OdometryPose(v1::OdometryPose { odometry_from_robot: Some(wire) })) => {
                if let Ok(pose) = pose::pose("", wire) {
                    self.odometry.add_pose(stamp_ns, pose);
                }
                return;
            }
            Some(Kind::OdometryVelocity(v1::OdometryVelocity {
                forward_m_per_s,
                left_m_per_s,
                turn_rad_per_s,
            })) => {
                let velocity = Velocity { forward_m_per_s, left_m_per_s, turn_rad_per_s };
                self.odometry.add_velocity(stamp_ns, velocity);
                return;
            }
            Some(Kind::Mark(v1::Mark { label })) => {
                self.sees_home |= label == HOME;
                return;
            }
            Some(
                Kind::SonarScan(v1::SonarScan { ranges_m })
                | Kind::LaserScan(v1::LaserScan { ranges_m, intensities: _ }),
            ) => ranges_m,
            Some(Kind::OdometryPose(_) | Kind::LandmarkSighting(_) | Kind::PlaceVisit(_))
            | None => {
                return;
            }
        };
        if sensor_id == self.eye.sensor() {
            self.fire(Moment { batch, stamp_ns }, &ranges_m);
        }
    }

    fn fire(&mut self, moment: Moment, ranges_m: &[f32]) {
        let stamp_ns = moment.stamp_ns;
        let is_room = self.guide.n_firings() < self.limits.n_firings_max;
        let odometry: Option<Pose> = self.odometry.pose_at(stamp_ns).filter(|_| is_room);
        let Some(odometry_from_robot) = odometry else {
            self.n_left_out += 1;
            return;
        };
        let sees_home = std::mem::take(&mut self.sees_home);
        let ranges_m = &self.eye.ring(ranges_m)[..];
        self.guide.take_in(&Firing { ranges_m, odometry_from_robot, sees_home });
        self.stamp_ns = stamp_ns;
        let n_stops = self.guide.explorer().itinerary().stops().len();
        self.moments.resize(n_stops, moment);
    }
}

fn guide(begun: &Begun, limits: &QualitativeSettings) -> Guide {
    Guide::new(Explorer::new(begun.params(limits.n_places_max)), GuideParams::WHEELS)
}
