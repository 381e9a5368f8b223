//! The log of a drive of the wanderer in Python is replayed to the byte.

use std::path::Path;

use wanderer::messages::{COMMAND, SCAN};
use wanderer::replay::{read, replay, Recorded};

fn recorded() -> Vec<Recorded> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../wanderer.mcap");
    read(&std::fs::read(path).unwrap()).unwrap()
}

fn command(recorded: &mut [Recorded], number: u64) -> &mut Recorded {
    let mut messages = recorded.iter_mut();
    messages
        .find(|each| each.envelope.topic == COMMAND && each.envelope.seq == number)
        .unwrap()
}

#[test]
fn a_drive_of_the_wanderer_in_python_has_the_same_bytes() {
    let found = replay(&recorded()).unwrap();

    assert_eq!((found.same, found.different, found.first), (60, 0, None));
}

#[test]
fn the_first_difference_is_named() {
    let mut recorded = recorded();
    for number in [7, 9] {
        // The last byte is the age of the pose.
        *command(&mut recorded, number).payload.last_mut().unwrap() = 1;
    }

    let found = replay(&recorded).unwrap();

    assert_eq!((found.same, found.different), (58, 2));
    let first = "motor/command number 7 of motor: pose_age_ns is 1 in the log, 0 in the replay";
    assert_eq!(found.first.unwrap(), first);
}

#[test]
fn an_input_that_the_log_lacks_is_named() {
    let mut recorded = recorded();
    command(&mut recorded, 7).envelope.causes[0].2 = 1000;

    let first = replay(&recorded).unwrap().first.unwrap();

    let lacks = "the log lacks sensory/scan number 1000 of sensory, which led to it";
    assert_eq!(first, format!("motor/command number 7 of motor: {lacks}"));
}

#[test]
fn inputs_of_a_restarted_source_are_told_apart_by_when_they_were_sent() {
    let mut recorded = recorded();
    let last_ns = recorded.last().unwrap().envelope.sent_ns;
    let mut scans: Vec<Recorded> = recorded
        .iter()
        .filter(|each| each.envelope.topic == SCAN)
        .cloned()
        .collect();
    let payloads: Vec<Vec<u8>> = scans.iter().map(|each| each.payload.clone()).collect();
    for (scan, payload) in scans.iter_mut().zip(payloads.into_iter().rev()) {
        scan.envelope.sent_ns = last_ns + 1;
        scan.payload = payload;
    }
    recorded.append(&mut scans);

    assert_eq!(replay(&recorded).unwrap().same, 60);
}

#[test]
fn an_input_is_found_though_the_clock_of_its_source_is_ahead() {
    let mut recorded = recorded();
    for each in &mut recorded {
        if each.envelope.topic == SCAN {
            each.envelope.sent_ns += 1_000_000_000;
        }
    }

    assert_eq!(replay(&recorded).unwrap().same, 60);
}

#[test]
fn a_log_without_commands_is_refused() {
    let refusal = replay(&[]).err().unwrap();

    assert_eq!(refusal, "the log holds no motor/command of motor");
}
