// Every golden message is decoded, and encoded to the same bytes.

import assert from "node:assert/strict";
import { readFileSync, readdirSync } from "node:fs";
import { test } from "node:test";

import { decode, encode } from "../messages.mjs";

const GOLDEN = new URL("../../../schemas/golden/", import.meta.url);
const files = readdirSync(GOLDEN).filter((name) => name.endsWith(".msgpack"));

test("there are golden messages", () => {
  assert.ok(files.length > 0);
});

for (const file of files) {
  test(`${file} keeps its bytes`, () => {
    const bytes = readFileSync(new URL(file, GOLDEN));

    const again = encode(decode(bytes));

    assert.deepEqual(Buffer.from(again), bytes);
  });
}
