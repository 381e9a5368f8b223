//! The messages of the wanderer, with the fields in the order in which they travel.

use serde::{Deserialize, Serialize};
use serde_bytes::ByteBuf;

pub const SCAN: &str = "sensory/scan";
pub const COMMAND: &str = "motor/command";

/// Why a message is not answered.
pub type Refusal = String;

/// An array as it travels: little endian, row after row.
#[derive(Clone, Deserialize, Serialize)]
pub struct Array {
    pub dtype: String,
    pub shape: Vec<u64>,
    pub data: ByteBuf,
}

impl Array {
    /// The values, if they are of 32 bits.
    pub fn floats(&self) -> Result<Vec<f32>, Refusal> {
        if self.dtype != "<f4" {
            return Err(format!("an array of {} where <f4 is expected", self.dtype));
        }

        let values = self.data.chunks_exact(4);
        Ok(values
            .map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap()))
            .collect())
    }
}

#[derive(Clone, Deserialize, Serialize)]
pub struct RangeScan {
    pub stamp_ns: u64,
    pub seq: u64,
    pub source: String,
    pub frame: u64,
    pub bearing_rad: Array,
    pub range_m: Array,
}

#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct MotorCommand {
    pub stamp_ns: u64,
    pub seq: u64,
    pub source: String,
    pub left_wheel_rad_s: f64,
    pub right_wheel_rad_s: f64,
    pub halted_by: String,
    pub slowed_by: String,
    pub pose_age_ns: u64,
}

/// An input that led to an output: topic, source, number.
pub type Cause = (String, String, u64);

/// What travels beside each message, as a msgpack array. Further elements may follow.
///
/// A stage is a module, its nanoseconds of computing, and those of everything else.
#[derive(Serialize)]
pub struct Envelope {
    pub source: String,
    pub seq: u64,
    pub incarnation: u64,
    pub sent_ns: u64,
    pub born_ns: u64,
    pub stages: Vec<(String, i64, i64)>,
    pub causes: Vec<Cause>,
}

/// The time of the sensing that the message with this envelope derives from, on the wall's clock.
pub fn born_ns(envelope: &[u8]) -> Result<u64, Refusal> {
    let parts = rmpv::decode::read_value(&mut &envelope[..]).map_err(|error| error.to_string())?;
    parts[4]
        .as_u64()
        .ok_or("an envelope without a birth".into())
}

/// The bytes of a message.
pub fn encode(message: &impl Serialize) -> Vec<u8> {
    rmp_serde::to_vec_named(message).expect("a message of numbers and text")
}
