// Messages to bytes and back. In msgpack 10 and 10.0 are two values, in JavaScript one: a number
// that travels as a float is a Float here, so that a message keeps its bytes.

import { Decoder, Encoder } from "@msgpack/msgpack";

export const SCAN = "sensory/scan";
export const COMMAND = "motor/command";

/**
 * A number that travels as a float, whatever its value. It computes as a number does; but it is an
 * object, so take Number(value) before === or a condition: even a Float of 0 is true.
 */
export class Float extends Number {}

// The library has no option for this. Its version is pinned, and the golden messages test it.
class ExactEncoder extends Encoder {
  encodeObject(value, depth) {
    if (value instanceof Float) {
      this.encodeNumberAsFloat(value);
    } else {
      super.encodeObject(value, depth);
    }
  }
}

class ExactDecoder extends Decoder {
  readF64() {
    return new Float(super.readF64());
  }
}

const OPTIONS = { useBigInt64: true };

/** Return the bytes of a message: integers from 2^32 on are BigInt, floats are Float. */
export function encode(message) {
  return new ExactEncoder(OPTIONS).encode(message);
}

/** Return the message in `bytes`. */
export function decode(bytes) {
  return new ExactDecoder(OPTIONS).decode(bytes);
}

/** Return the values of an array that travelled, if they are of 32 bits. */
export function floats(array) {
  if (array.dtype !== "<f4") {
    throw new Error(`an array of ${array.dtype} where <f4 is expected`);
  }

  const { buffer, byteOffset, byteLength } = array.data;
  const view = new DataView(buffer, byteOffset, byteLength);
  return Array.from({ length: byteLength / 4 }, (_, index) => view.getFloat32(4 * index, true));
}
