// Is the output of the wanderer the same as in a log? `node replay.mjs LOG`, after `npm ci`.
//
// Ends with 1 if a byte differs, and names the first difference.

import { pathToFileURL } from "node:url";

import { COMMAND, SCAN, decode, encode } from "./messages.mjs";
import { read } from "./recording.mjs";
import { INSTANCE, Wanderer } from "./wanderer.mjs";

/**
 * Replay what a log holds: each process that sent commands by itself, from its first command on,
 * with its inputs in the order of the causes that it named. Returns how many commands are the same
 * to the byte, how many are not, and the first of these in words.
 */
export function replay(recorded) {
  const commands = recorded.filter(
    ({ envelope }) => envelope.topic === COMMAND && envelope.source === INSTANCE,
  );
  if (commands.length === 0) {
    throw new Error(`the log holds no ${COMMAND} of ${INSTANCE}`);
  }
  commands.sort((one, other) => order(one.envelope, other.envelope));
  const inputs = byName(recorded);

  const found = { same: 0, different: 0, first: null };
  let wanderer = null;
  let incarnation = null;
  for (const command of commands) {
    const { envelope } = command;
    if (envelope.incarnation !== incarnation) {
      wanderer = new Wanderer(envelope.seq);
      incarnation = envelope.incarnation;
    }

    const clause = difference(wanderer, command, inputs);
    if (clause === null) {
      found.same += 1;
    } else {
      found.different += 1;
      found.first ??= `${COMMAND} number ${envelope.seq} of ${INSTANCE}: ${clause}`;
    }
  }
  return found;
}

function order(one, other) {
  if (one.incarnation !== other.incarnation) {
    return one.incarnation < other.incarnation ? -1 : 1;
  }
  return one.seq - other.seq;
}

/** Return what differs between a recorded command and the answer to its causes, null if nothing. */
function difference(wanderer, command, inputs) {
  const answers = [];
  for (const cause of command.envelope.causes) {
    const [topic] = cause;
    if (topic !== SCAN) {
      return `a ${topic} led to it, which the wanderer does not receive`;
    }

    const name = title(cause);
    const input = sentBy(command.envelope.sent_ns, inputs.get(name) ?? []);
    if (input === undefined) {
      return `the log lacks ${name}, which led to it`;
    }
    try {
      answers.push(encode(wanderer.onScan(decode(input.payload))));
    } catch (error) {
      return `${name} is refused: ${error.message}`;
    }
  }

  if (answers.length !== 1) {
    return `${answers.length} scans led to it, not 1`;
  }
  return inWords(command.payload, answers[0]);
}

/** Return the messages of each name, those sent first first. */
function byName(recorded) {
  const inputs = new Map();
  for (const message of recorded) {
    const { topic, source, seq } = message.envelope;
    const name = title([topic, source, seq]);
    inputs.set(name, [...(inputs.get(name) ?? []), message]);
  }

  for (const messages of inputs.values()) {
    messages.sort((one, other) => (one.envelope.sent_ns < other.envelope.sent_ns ? -1 : 1));
  }
  return inputs;
}

function title([topic, source, number]) {
  return `${topic} number ${number} of ${source}`;
}

/**
 * Return the one of `messages` of a name that is meant: a source that was restarted numbers its
 * messages anew, so the last one sent by `sentNs`, or the first if their clocks say that none was.
 */
function sentBy(sentNs, messages) {
  return messages.findLast(({ envelope }) => envelope.sent_ns <= sentNs) ?? messages[0];
}

/** Return the first field in which two messages differ, null if their bytes are the same. */
function inWords(logged, replayed) {
  if (Buffer.compare(logged, replayed) === 0) {
    return null;
  }

  const left = decode(logged);
  const right = decode(replayed);
  for (const [name, value] of Object.entries(left)) {
    const other = right[name] ?? "absent";
    if (String(value) !== String(other)) {
      return `${name} is ${value} in the log, ${other} in the replay`;
    }
  }
  return "the same values in other bytes, or in another order";
}

async function main(path) {
  if (path === undefined) {
    console.error("replay: name a log, such as runs/latest/log.mcap");
    return 2;
  }

  try {
    const { same, different, first } = replay(await read(path, [SCAN, COMMAND]));
    console.log(`motor: ${same} commands the same to the byte, ${different} not`);
    if (first !== null) {
      console.log(`first difference: ${first}`);
    }
    return first === null ? 0 : 1;
  } catch (error) {
    console.error(`replay: ${path}: ${error.message}`);
    return 2;
  }
}

if (import.meta.url === pathToFileURL(process.argv[1] ?? "").href) {
  process.exitCode = await main(process.argv[2]);
}
