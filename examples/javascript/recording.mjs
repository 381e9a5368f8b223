// Reads a log: an MCAP file whose channel `_envelope` holds the envelopes of the other messages.

import { readFile } from "node:fs/promises";

import { McapIndexedReader } from "@mcap/core";
import { loadDecompressHandlers } from "@mcap/support";

import { decode } from "./messages.mjs";

const ENVELOPES = "_envelope";

/** Return the messages on `topics`, each with its envelope, in the order in which they came. */
export async function read(path, topics) {
  const bytes = await readFile(path);
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)),
  };
  const decompressHandlers = await loadDecompressHandlers();
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });

  // An envelope has the log time and the sequence of its message, and names its topic.
  const envelopes = new Map();
  const messages = [];
  for await (const message of reader.readMessages({ topics: [ENVELOPES, ...topics] })) {
    const { topic } = reader.channelsById.get(message.channelId);
    const place = `${message.logTime} ${message.sequence}`;
    if (topic === ENVELOPES) {
      const envelope = decode(message.data);
      envelopes.set(`${place} ${envelope.topic}`, envelope);
    } else {
      messages.push({ place: `${place} ${topic}`, payload: message.data });
    }
  }

  return messages.map(({ place, payload }) => {
    const envelope = envelopes.get(place);
    if (envelope === undefined) {
      throw new Error("a message in the log has no envelope");
    }
    return { envelope, payload };
  });
}
