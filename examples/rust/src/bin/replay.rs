//! Is the output of the wanderer the same as in a log? `cargo run --bin replay -- LOG`
//!
//! Ends with 1 if a byte differs, and names the first difference.

use std::error::Error;
use std::process::ExitCode;

use wanderer::replay::{read, replay, Found};

fn main() -> ExitCode {
    let Some(path) = std::env::args().nth(1) else {
        eprintln!("replay: name a log, such as runs/latest/log.mcap");
        return ExitCode::from(2);
    };
    let Found {
        same,
        different,
        first,
    } = match replayed(&path) {
        Ok(found) => found,
        Err(error) => {
            eprintln!("replay: {path}: {error}");
            return ExitCode::from(2);
        }
    };

    println!("motor: {same} commands the same to the byte, {different} not");
    if let Some(first) = first {
        println!("first difference: {first}");
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}

fn replayed(path: &str) -> Result<Found, Box<dyn Error>> {
    let log = std::fs::read(path)?;
    Ok(replay(&read(&log)?)?)
}
