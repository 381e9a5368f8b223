// Prints the messages in files of msgpack as JSON: `node golden.mjs FILE...`, after `npm ci`.
//
// Bytes become base64 text. Integers beyond 2^53 become text too, as JavaScript's JSON has no more.

import { readFileSync } from "node:fs";
import { basename } from "node:path";

import { decode } from "@msgpack/msgpack";

function plain(value) {
  if (value instanceof Uint8Array) {
    return Buffer.from(value).toString("base64");
  }
  if (typeof value === "bigint") {
    return Number.isSafeInteger(Number(value)) ? Number(value) : String(value);
  }
  if (Array.isArray(value)) {
    return value.map(plain);
  }
  if (value !== null && typeof value === "object") {
    const fields = Object.entries(value).map(([name, part]) => [name, plain(part)]);
    return Object.fromEntries(fields);
  }
  return value;
}

const messages = {};
for (const path of process.argv.slice(2)) {
  messages[basename(path)] = plain(decode(readFileSync(path), { useBigInt64: true }));
}
console.log(JSON.stringify(messages));
