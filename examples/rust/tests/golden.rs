//! Every golden message is decoded, and encoded to the same bytes.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{de::DeserializeOwned, Serialize};
use wanderer::messages::{encode, MotorCommand, RangeScan};

fn golden() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../schemas/golden")
}

#[test]
fn every_message_keeps_its_bytes() {
    let mut messages = 0;
    for entry in fs::read_dir(golden()).unwrap() {
        let path = entry.unwrap().path();
        let bytes = fs::read(&path).unwrap();

        let value = rmpv::decode::read_value(&mut bytes.as_slice()).unwrap();
        let mut again = Vec::new();
        rmpv::encode::write_value(&mut again, &value).unwrap();

        assert!(value.is_map());
        assert_eq!(again, bytes, "{}", path.display());
        messages += 1;
    }
    assert!(messages > 0);
}

fn keeps_its_bytes<T: DeserializeOwned + Serialize>(file: &str) {
    let bytes = fs::read(golden().join(file)).unwrap();
    let message: T = rmp_serde::from_slice(&bytes).unwrap();
    assert_eq!(encode(&message), bytes);
}

#[test]
fn a_scan_has_the_fields_of_the_schema() {
    keeps_its_bytes::<RangeScan>("sensory.scan.msgpack");
}

#[test]
fn a_command_has_the_fields_of_the_schema() {
    keeps_its_bytes::<MotorCommand>("motor.command.msgpack");
}
