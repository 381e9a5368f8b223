//! The core: scans in, commands out. It has no clock, no bus, no file and no random numbers.

use crate::messages::{MotorCommand, RangeScan, Refusal};

pub const INSTANCE: &str = "motor";
const AHEAD_RAD: f64 = 0.3;
const CLEARANCE_M: f64 = 4.0;
const CRUISE_RAD_S: f64 = 10.0;

/// Drives straight on, and turns left where something is in its way.
pub struct Wanderer {
    number: u64,
}

impl Wanderer {
    /// A wanderer whose first command has this number.
    pub fn new(number: u64) -> Self {
        Wanderer { number }
    }

    /// The command that answers a scan. A scan that makes no sense changes nothing.
    pub fn on_scan(&mut self, scan: &RangeScan) -> Result<MotorCommand, Refusal> {
        let bearings_rad = scan.bearing_rad.floats()?;
        let ranges_m = scan.range_m.floats()?;
        if bearings_rad.len() != ranges_m.len() {
            let (bearings, ranges) = (bearings_rad.len(), ranges_m.len());
            return Err(format!("a scan with {bearings} bearings, {ranges} ranges"));
        }

        let mut rays = bearings_rad.into_iter().zip(ranges_m);
        let blocked = rays.any(|(bearing_rad, range_m)| {
            let is_ahead = f64::from(bearing_rad).abs() < AHEAD_RAD;
            is_ahead && range_m > 0.0 && f64::from(range_m) < CLEARANCE_M
        });

        let command = MotorCommand {
            stamp_ns: scan.stamp_ns,
            seq: self.number,
            source: INSTANCE.into(),
            left_wheel_rad_s: if blocked { 0.0 } else { CRUISE_RAD_S },
            right_wheel_rad_s: CRUISE_RAD_S,
            halted_by: String::new(),
            slowed_by: String::new(),
            pose_age_ns: 0,
        };
        self.number += 1;
        Ok(command)
    }
}
