// The log of a drive of the wanderer in Python is replayed to the byte.

import assert from "node:assert/strict";
import { test } from "node:test";
import { fileURLToPath } from "node:url";

import { COMMAND, SCAN } from "../messages.mjs";
import { read } from "../recording.mjs";
import { replay } from "../replay.mjs";

const LOG = fileURLToPath(new URL("../../wanderer.mcap", import.meta.url));

async function recorded() {
  return read(LOG, [SCAN, COMMAND]);
}

function command(messages, number) {
  return messages.find(({ envelope }) => envelope.topic === COMMAND && envelope.seq === number);
}

test("a drive of the wanderer in Python has the same bytes", async () => {
  assert.deepEqual(replay(await recorded()), { same: 60, different: 0, first: null });
});

test("the first difference is named", async () => {
  const messages = await recorded();
  for (const number of [7, 9]) {
    const changed = command(messages, number);
    // The last byte is the age of the pose.
    changed.payload = Uint8Array.of(...changed.payload.slice(0, -1), 1);
  }

  assert.deepEqual(replay(messages), {
    same: 58,
    different: 2,
    first: "motor/command number 7 of motor: pose_age_ns is 1 in the log, 0 in the replay",
  });
});

test("an input that the log lacks is named", async () => {
  const messages = await recorded();
  command(messages, 7).envelope.causes[0][2] = 1000;

  const { first } = replay(messages);

  const lacks = "the log lacks sensory/scan number 1000 of sensory, which led to it";
  assert.equal(first, `motor/command number 7 of motor: ${lacks}`);
});

test("a restarted source's inputs are told apart by when they were sent", async () => {
  const messages = await recorded();
  const scans = messages.filter(({ envelope }) => envelope.topic === SCAN);
  const lastNs = messages.at(-1).envelope.sent_ns;
  for (const [number, { envelope }] of scans.entries()) {
    const payload = scans[scans.length - 1 - number].payload;
    messages.push({ envelope: { ...envelope, sent_ns: lastNs + 1n }, payload });
  }

  assert.equal(replay(messages).same, 60);
});

test("an input is found though the clock of its source is ahead", async () => {
  const messages = await recorded();
  for (const { envelope } of messages.filter(({ envelope }) => envelope.topic === SCAN)) {
    envelope.sent_ns += 1_000_000_000n;
  }

  assert.equal(replay(messages).same, 60);
});

test("a log without commands is refused", () => {
  assert.throws(() => replay([]), /the log holds no motor\/command of motor/);
});
