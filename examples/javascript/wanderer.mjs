// The core: scans in, commands out. It has no clock, no bus, no file and no random numbers.

import { Float, floats } from "./messages.mjs";

export const INSTANCE = "motor";
const AHEAD_RAD = 0.3;
const CLEARANCE_M = 4.0;
const CRUISE_RAD_S = 10.0;

/** Drives straight on, and turns left where something is in its way. */
export class Wanderer {
  #number;

  /** A wanderer whose first command has this number. */
  constructor(number = 0) {
    this.#number = number;
  }

  /** Return the command that answers a scan. A scan that makes no sense throws, and changes nothing. */
  onScan(scan) {
    const bearingsRad = floats(scan.bearing_rad);
    const rangesM = floats(scan.range_m);
    if (bearingsRad.length !== rangesM.length) {
      throw new Error(`a scan with ${bearingsRad.length} bearings, ${rangesM.length} ranges`);
    }

    const blocked = bearingsRad.some((bearingRad, ray) => {
      const isAhead = Math.abs(bearingRad) < AHEAD_RAD;
      return isAhead && rangesM[ray] > 0 && rangesM[ray] < CLEARANCE_M;
    });

    // The fields in the order of the schema, as they travel.
    const command = {
      stamp_ns: scan.stamp_ns,
      seq: this.#number,
      source: INSTANCE,
      left_wheel_rad_s: new Float(blocked ? 0 : CRUISE_RAD_S),
      right_wheel_rad_s: new Float(CRUISE_RAD_S),
      halted_by: "",
      slowed_by: "",
      pose_age_ns: 0,
    };
    this.#number += 1;
    return command;
  }
}
