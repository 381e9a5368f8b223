// The core alone.

import assert from "node:assert/strict";
import { test } from "node:test";

import { Wanderer } from "../wanderer.mjs";

function array(values) {
  return {
    dtype: "<f4",
    shape: [values.length],
    data: new Uint8Array(Float32Array.from(values).buffer),
  };
}

function scan(bearingsRad, rangesM) {
  return { stamp_ns: 7, seq: 0, bearing_rad: array(bearingsRad), range_m: array(rangesM) };
}

function leftRadS(bearingRad, rangeM) {
  const command = new Wanderer().onScan(scan([bearingRad], [rangeM]));
  return Number(command.left_wheel_rad_s);
}

test("it turns left where something is in its way", () => {
  assert.equal(leftRadS(0.1, 2), 0);
});

test("it drives on past what is far or aside or not seen", () => {
  assert.equal(leftRadS(0.1, 20), 10);
  assert.equal(leftRadS(-0.5, 2), 10);
  assert.equal(leftRadS(0.1, 0), 10);
});

test("a command has the stamp of its scan and the next number", () => {
  const wanderer = new Wanderer(3);

  const first = wanderer.onScan(scan([0], [9]));
  const second = wanderer.onScan(scan([0], [9]));

  assert.deepEqual([first.stamp_ns, first.seq, second.seq], [7, 3, 4]);
});

test("a scan that makes no sense takes no number", () => {
  const wanderer = new Wanderer();

  assert.throws(() => wanderer.onScan(scan([0, 0.1], [9])), /a scan with 2 bearings, 1 ranges/);

  assert.equal(wanderer.onScan(scan([0], [9])).seq, 0);
});
