//! Feeds the wanderer what a log says that it received, and compares its commands with the log.

use std::collections::HashMap;
use std::error::Error;

use rmpv::Value;
use serde::Deserialize;

use crate::messages::{encode, Cause, RangeScan, COMMAND, SCAN};
use crate::wanderer::{Wanderer, INSTANCE};

const ENVELOPES: &str = "_envelope";

/// The envelope of a message as a log holds it, on a channel of its own. It has the log time and
/// the sequence of its message.
#[derive(Clone, Deserialize)]
pub struct Envelope {
    pub topic: String,
    pub source: String,
    pub seq: u64,
    pub incarnation: u64,
    pub sent_ns: u64,
    pub causes: Vec<Cause>,
}

/// A message in a log, as it travelled.
#[derive(Clone)]
pub struct Recorded {
    pub envelope: Envelope,
    pub payload: Vec<u8>,
}

/// Messages by what a cause names them by.
type Inputs<'a> = HashMap<Cause, Vec<&'a Recorded>>;

/// How many commands are the same to the byte, how many are not, and the first of these in words.
#[derive(Default)]
pub struct Found {
    pub same: usize,
    pub different: usize,
    pub first: Option<String>,
}

/// The scans and the commands in `log`, the bytes of an MCAP file.
pub fn read(log: &[u8]) -> Result<Vec<Recorded>, Box<dyn Error>> {
    let mut envelopes = HashMap::new();
    let mut payloads = Vec::new();
    for message in mcap::MessageStream::new(log)? {
        let message = message?;
        let place = (message.log_time, message.sequence);
        match message.channel.topic.as_str() {
            ENVELOPES => {
                let envelope: Envelope = rmp_serde::from_slice(&message.data)?;
                envelopes.insert((place, envelope.topic.clone()), envelope);
            }
            topic @ (SCAN | COMMAND) => {
                payloads.push(((place, topic.to_string()), message.data.into_owned()));
            }
            _ => {}
        }
    }

    let mut recorded = Vec::new();
    for (place, payload) in payloads {
        let envelope = envelopes.remove(&place);
        let envelope = envelope.ok_or("a message in the log has no envelope")?;
        recorded.push(Recorded { envelope, payload });
    }
    Ok(recorded)
}

/// Replay what a log holds: each process that sent commands by itself, from its first command on,
/// with its inputs in the order of the causes that it named.
pub fn replay(recorded: &[Recorded]) -> Result<Found, String> {
    let mut commands: Vec<&Recorded> = recorded
        .iter()
        .filter(|each| each.envelope.topic == COMMAND && each.envelope.source == INSTANCE)
        .collect();
    if commands.is_empty() {
        return Err(format!("the log holds no {COMMAND} of {INSTANCE}"));
    }
    commands.sort_by_key(|each| (each.envelope.incarnation, each.envelope.seq));

    let inputs = by_name(recorded);
    let mut found = Found::default();
    for process in commands.chunk_by(|a, b| a.envelope.incarnation == b.envelope.incarnation) {
        let mut wanderer = Wanderer::new(process[0].envelope.seq);
        for command in process {
            match difference(&mut wanderer, command, &inputs) {
                None => found.same += 1,
                Some(clause) => {
                    found.different += 1;
                    let title = format!("{COMMAND} number {} of {INSTANCE}", command.envelope.seq);
                    found.first.get_or_insert(format!("{title}: {clause}"));
                }
            }
        }
    }
    Ok(found)
}

/// What differs between a recorded command and the answer to its causes, if anything does.
fn difference(wanderer: &mut Wanderer, command: &Recorded, inputs: &Inputs) -> Option<String> {
    let mut answers = Vec::new();
    for cause in &command.envelope.causes {
        let (topic, source, number) = cause;
        if topic != SCAN {
            return Some(format!(
                "a {topic} led to it, which the wanderer does not receive"
            ));
        }

        let name = format!("{topic} number {number} of {source}");
        let named = inputs.get(cause);
        let input = named.and_then(|named| sent_by(command.envelope.sent_ns, named));
        let Some(input) = input else {
            return Some(format!("the log lacks {name}, which led to it"));
        };
        let scan = rmp_serde::from_slice::<RangeScan>(&input.payload);
        let scan = scan.map_err(|error| error.to_string());
        match scan.and_then(|scan| wanderer.on_scan(&scan)) {
            Ok(answer) => answers.push(encode(&answer)),
            Err(reason) => return Some(format!("{name} is refused: {reason}")),
        }
    }

    match answers.as_slice() {
        [answer] => in_words(&command.payload, answer),
        _ => Some(format!("{} scans led to it, not 1", answers.len())),
    }
}

/// The messages of each name, those sent first first.
fn by_name(recorded: &[Recorded]) -> Inputs<'_> {
    let mut inputs: Inputs = HashMap::new();
    for each in recorded {
        let Envelope {
            topic, source, seq, ..
        } = &each.envelope;
        let name = (topic.clone(), source.clone(), *seq);
        inputs.entry(name).or_default().push(each);
    }

    for messages in inputs.values_mut() {
        messages.sort_by_key(|each| each.envelope.sent_ns);
    }
    inputs
}

/// The one of `messages` of a name that is meant. A source that was restarted numbers its messages
/// anew: it is the last one sent by `sent_ns`, or the first if their clocks say that none was.
fn sent_by<'a>(sent_ns: u64, messages: &[&'a Recorded]) -> Option<&'a Recorded> {
    let mut sent_first = messages.iter();
    let last = sent_first.rfind(|each| each.envelope.sent_ns <= sent_ns);
    last.or(messages.first()).copied()
}

/// The first field in which two messages differ, None if their bytes are the same.
fn in_words(logged: &[u8], replayed: &[u8]) -> Option<String> {
    if logged == replayed {
        return None;
    }
    let (Some(left), Some(right)) = (fields(logged), fields(replayed)) else {
        return Some("one of the two is no message".into());
    };

    let absent = Value::from("absent");
    for (name, value) in &left {
        let other = right.iter().find(|each| each.0 == *name);
        let other = other.map_or(&absent, |each| &each.1);
        if value != other {
            let name = name.as_str().unwrap_or("?");
            return Some(format!(
                "{name} is {value} in the log, {other} in the replay"
            ));
        }
    }
    Some("the same values in other bytes, or in another order".into())
}

fn fields(mut payload: &[u8]) -> Option<Vec<(Value, Value)>> {
    match rmpv::decode::read_value(&mut payload).ok()? {
        Value::Map(fields) => Some(fields),
        _ => None,
    }
}
