// The wanderer on the bus, in the place of `motor`, after `npm ci`.
//
// Run it beside the others: `cogmap run --without motor`, Zenoh's bridge for JavaScript,
// `zenoh-bridge-remote-api -e tcp/127.0.0.1:7447 --ws-port 10000`, and
// `npm run bus -- ws/127.0.0.1:10000`.

import { Config, Session } from "@eclipse-zenoh/zenoh-ts";

import { COMMAND, SCAN, decode, encode } from "./messages.mjs";
import { INSTANCE, Wanderer } from "./wanderer.mjs";

const [endpoint = "ws/127.0.0.1:10000", agent = "agent"] = process.argv.slice(2);

function nowNs() {
  return BigInt(Date.now()) * 1_000_000n;
}

/** Return the command that answers a sample, and its envelope. Throws if the sample makes no sense. */
function answer(wanderer, sample, incarnation) {
  const attachment = sample.attachment();
  if (attachment === undefined) {
    throw new Error("no envelope");
  }
  const bornNs = decode(attachment.toBytes())[4];
  const scan = decode(sample.payload().toBytes());

  const command = wanderer.onScan(scan);
  const causes = [[SCAN, scan.source, scan.seq]];
  // Source, number, incarnation, sent, born, stages, causes.
  const envelope = [INSTANCE, command.seq, incarnation, nowNs(), bornNs, [], causes];
  return { command, envelope };
}

const incarnation = nowNs();
const session = await Session.open(new Config(endpoint));
const commands = await session.declarePublisher(`cogmap/${agent}/${COMMAND}`);
const scans = await session.declareSubscriber(`cogmap/${agent}/${SCAN}`);
const tokens = [
  `cogmap/${agent}/@incarnation/motor/${INSTANCE}/${incarnation}`,
  `cogmap/${agent}/@ready/motor/${INSTANCE}`,
];
for (const token of tokens) {
  await session.liveliness().declareToken(token);
}

const wanderer = new Wanderer();
for await (const sample of scans.receiver()) {
  try {
    const { command, envelope } = answer(wanderer, sample, incarnation);
    await commands.put(encode(command), { attachment: encode(envelope) });
  } catch (error) {
    console.error(`wanderer: a scan is ignored: ${error.message}`);
  }
}
