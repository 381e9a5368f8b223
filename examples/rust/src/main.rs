//! The wanderer in Rust: drives by the range scan alone, in the place of `motor`.
//!
//! Run it beside the others: `cogmap run --without motor`, and `cargo run -- tcp/127.0.0.1:7447`.

use std::error::Error;
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};
use serde_bytes::ByteBuf;
use zenoh::{Config, Wait};

const INSTANCE: &str = "motor";
const AHEAD_RAD: f32 = 0.3;
const CLEARANCE_M: f32 = 4.0;
const CRUISE_RAD_S: f64 = 10.0;

/// An array as it travels: little endian, row after row.
#[derive(Deserialize)]
struct Array {
    dtype: String,
    data: ByteBuf,
}

#[derive(Deserialize)]
struct RangeScan {
    stamp_ns: i64,
    bearing_rad: Array,
    range_m: Array,
}

#[derive(Serialize)]
struct MotorCommand {
    stamp_ns: i64,
    seq: u64,
    source: &'static str,
    left_wheel_rad_s: f64,
    right_wheel_rad_s: f64,
}

/// Source, number, incarnation, sent, born, stages (module, compute, rest), causes (topic, source,
/// number): beside each message, as a msgpack array. Further elements may follow.
type Envelope = (
    String,
    u64,
    u64,
    u64,
    u64,
    Vec<(String, i64, i64)>,
    Vec<(String, String, u64)>,
);

fn floats(array: &Array) -> Result<Vec<f32>, Box<dyn Error>> {
    if array.dtype != "<f4" {
        return Err(format!("an array of {} where <f4 is expected", array.dtype).into());
    }

    let values = array.data.chunks_exact(4);
    Ok(values
        .map(|bytes| f32::from_le_bytes(bytes.try_into().unwrap()))
        .collect())
}

/// The message that answers a scan.
fn command(scan: &RangeScan, number: u64) -> Result<MotorCommand, Box<dyn Error>> {
    let bearings_rad = floats(&scan.bearing_rad)?;
    let ranges_m = floats(&scan.range_m)?;
    let blocked = bearings_rad
        .iter()
        .zip(&ranges_m)
        .any(|(bearing_rad, range_m)| {
            bearing_rad.abs() < AHEAD_RAD && *range_m > 0.0 && *range_m < CLEARANCE_M
        });

    Ok(MotorCommand {
        stamp_ns: scan.stamp_ns,
        seq: number,
        source: INSTANCE,
        left_wheel_rad_s: if blocked { 0.0 } else { CRUISE_RAD_S },
        right_wheel_rad_s: CRUISE_RAD_S,
    })
}

/// The time of the sensing that a message derives from, on the wall's clock.
fn born_ns(attachment: &[u8]) -> Result<u64, Box<dyn Error>> {
    let envelope = rmpv::decode::read_value(&mut &attachment[..])?;
    envelope[4]
        .as_u64()
        .ok_or("an envelope without a birth".into())
}

fn now_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.expect("a clock after 1970").as_nanos() as u64
}

fn configuration(endpoint: &str) -> zenoh::Result<Config> {
    let mut config = Config::default();
    config.insert_json5("mode", "\"client\"")?;
    config.insert_json5("connect/endpoints", &format!("[\"{endpoint}\"]"))?;
    config.insert_json5("scouting/multicast/enabled", "false")?;
    Ok(config)
}

fn run(endpoint: &str, agent: &str) -> Result<(), Box<dyn Error + Send + Sync>> {
    let started_ns = now_ns();
    let session = zenoh::open(configuration(endpoint)?).wait()?;
    let commands = session
        .declare_publisher(format!("cogmap/{agent}/motor/command"))
        .wait()?;
    let scans = session
        .declare_subscriber(format!("cogmap/{agent}/sensory/scan"))
        .wait()?;
    let _ready = session
        .liveliness()
        .declare_token(format!("cogmap/{agent}/@ready/motor/{INSTANCE}"))
        .wait()?;

    let mut number = 0;
    while let Ok(sample) = scans.recv() {
        let attachment = sample.attachment().map(|bytes| bytes.to_bytes());
        let scan = rmp_serde::from_slice(&sample.payload().to_bytes());
        let (Some(attachment), Ok(scan)) = (attachment, scan) else {
            eprintln!("wanderer: a scan that cannot be decoded is ignored");
            continue;
        };
        let answer = born_ns(&attachment).and_then(|born| Ok((born, command(&scan, number)?)));
        let (born, message) = match answer {
            Ok(answer) => answer,
            Err(reason) => {
                eprintln!("wanderer: a scan is ignored: {reason}");
                continue;
            }
        };

        let envelope: Envelope = (
            INSTANCE.into(),
            number,
            started_ns,
            now_ns(),
            born,
            vec![],
            vec![],
        );
        commands
            .put(rmp_serde::to_vec_named(&message)?)
            .attachment(rmp_serde::to_vec(&envelope)?)
            .wait()?;
        number += 1;
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error + Send + Sync>> {
    let mut arguments = std::env::args().skip(1);
    let endpoint = arguments.next().unwrap_or("tcp/127.0.0.1:7447".into());
    let agent = arguments.next().unwrap_or("agent".into());
    run(&endpoint, &agent)
}
