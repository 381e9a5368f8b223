//! The wanderer on the bus, in the place of `motor`.
//!
//! Run it beside the others: `cogmap run --without motor`, and
//! `cargo run --features bus -- tcp/127.0.0.1:7447`.

use std::error::Error;
use std::time::{SystemTime, UNIX_EPOCH};

use wanderer::messages::{born_ns, encode, Envelope, MotorCommand, RangeScan, COMMAND, SCAN};
use wanderer::wanderer::{Wanderer, INSTANCE};
use zenoh::sample::Sample;
use zenoh::{Config, Wait};

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

/// The command that answers a sample, and its envelope.
fn answer(
    wanderer: &mut Wanderer,
    sample: &Sample,
    incarnation: u64,
) -> Result<(MotorCommand, Envelope), String> {
    let attachment = sample.attachment().ok_or("no envelope")?;
    let born_ns = born_ns(&attachment.to_bytes())?;
    let scan: RangeScan =
        rmp_serde::from_slice(&sample.payload().to_bytes()).map_err(|error| error.to_string())?;

    let command = wanderer.on_scan(&scan)?;
    let envelope = Envelope {
        source: INSTANCE.into(),
        seq: command.seq,
        incarnation,
        sent_ns: now_ns(),
        born_ns,
        stages: vec![],
        causes: vec![(SCAN.into(), scan.source, scan.seq)],
    };
    Ok((command, envelope))
}

fn run(endpoint: &str, agent: &str) -> Result<(), Box<dyn Error + Send + Sync>> {
    let incarnation = now_ns();
    let session = zenoh::open(configuration(endpoint)?).wait()?;
    let commands = session
        .declare_publisher(format!("cogmap/{agent}/{COMMAND}"))
        .wait()?;
    let scans = session
        .declare_subscriber(format!("cogmap/{agent}/{SCAN}"))
        .wait()?;
    let _started = session
        .liveliness()
        .declare_token(format!(
            "cogmap/{agent}/@incarnation/motor/{INSTANCE}/{incarnation}"
        ))
        .wait()?;
    let _ready = session
        .liveliness()
        .declare_token(format!("cogmap/{agent}/@ready/motor/{INSTANCE}"))
        .wait()?;

    let mut wanderer = Wanderer::new(0);
    while let Ok(sample) = scans.recv() {
        let (command, envelope) = match answer(&mut wanderer, &sample, incarnation) {
            Ok(answer) => answer,
            Err(reason) => {
                eprintln!("wanderer: a scan is ignored: {reason}");
                continue;
            }
        };

        commands
            .put(encode(&command))
            .attachment(rmp_serde::to_vec(&envelope)?)
            .wait()?;
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error + Send + Sync>> {
    let mut arguments = std::env::args().skip(1);
    let endpoint = arguments.next().unwrap_or("tcp/127.0.0.1:7447".into());
    let agent = arguments.next().unwrap_or("agent".into());
    run(&endpoint, &agent)
}
