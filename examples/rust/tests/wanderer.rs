//! The core alone.

use serde_bytes::ByteBuf;
use wanderer::messages::{Array, RangeScan};
use wanderer::wanderer::Wanderer;

fn array(values: &[f32]) -> Array {
    let data: Vec<u8> = values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect();
    Array {
        dtype: "<f4".into(),
        shape: vec![values.len() as u64],
        data: ByteBuf::from(data),
    }
}

fn scan(bearings_rad: &[f32], ranges_m: &[f32]) -> RangeScan {
    RangeScan {
        stamp_ns: 7,
        seq: 0,
        source: "sensory".into(),
        frame: 0,
        bearing_rad: array(bearings_rad),
        range_m: array(ranges_m),
    }
}

fn left_rad_s(bearing_rad: f32, range_m: f32) -> f64 {
    let command = Wanderer::new(0).on_scan(&scan(&[bearing_rad], &[range_m]));
    command.unwrap().left_wheel_rad_s
}

#[test]
fn it_turns_left_where_something_is_in_its_way() {
    assert_eq!(left_rad_s(0.1, 2.0), 0.0);
}

#[test]
fn it_drives_on_past_what_is_far_or_aside_or_not_seen() {
    assert_eq!(left_rad_s(0.1, 20.0), 10.0);
    assert_eq!(left_rad_s(-0.5, 2.0), 10.0);
    assert_eq!(left_rad_s(0.1, 0.0), 10.0);
}

#[test]
fn a_command_has_the_stamp_of_its_scan_and_the_next_number() {
    let mut wanderer = Wanderer::new(3);
    let scan = scan(&[0.0], &[9.0]);

    let first = wanderer.on_scan(&scan).unwrap();
    let second = wanderer.on_scan(&scan).unwrap();

    assert_eq!((first.stamp_ns, first.seq, second.seq), (7, 3, 4));
}

#[test]
fn a_scan_that_makes_no_sense_takes_no_number() {
    let mut wanderer = Wanderer::new(0);

    let refusal = wanderer.on_scan(&scan(&[0.0, 0.1], &[9.0])).unwrap_err();

    assert_eq!(refusal, "a scan with 2 bearings, 1 ranges");
    assert_eq!(wanderer.on_scan(&scan(&[0.0], &[9.0])).unwrap().seq, 0);
}
