/* Decoding of a recording: the inverse of tisim/report/columns.py, compressed_trajectory.py and
   contact_network.py. Browsers inflate the data themselves. */

const WHOLE = { 8: Uint8Array, 16: Uint16Array, 32: Uint32Array };

/** The bytes of a text in base64. */
function fromBase64(text) {
  const binary = atob(text.trim());
  const bytes = new Uint8Array(binary.length);
  for (let k = 0; k < binary.length; k++) bytes[k] = binary.charCodeAt(k);
  return bytes;
}

/** The bytes of a zlib stream. */
async function inflate(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** The whole numbers of a column, one frame after another: [(frame * rows + row) * components + k]. */
function undifferenced(facts, planes, rows) {
  const parts = facts.origin.length, size = facts.bits / 8, plane = rows * facts.frames;
  const whole = new WHOLE[facts.bits](rows * facts.frames * parts);
  for (let part = 0; part < parts; part++) {
    for (let row = 0; row < rows; row++) {
      let value = 0, slope = 0;
      for (let frame = 0; frame < facts.frames; frame++) {
        let folded = 0;
        for (let k = 0; k < size; k++) {
          folded |= planes[(part * size + k) * plane + row * facts.frames + frame] << (8 * k);
        }
        const change = (folded >>> 1) ^ -(folded & 1);
        if (frame === 0 || facts.order === 0) {
          value = change;
        } else {
          slope = facts.order === 2 ? (slope + change) | 0 : change;
          value = (value + slope) | 0;
        }
        whole[(frame * rows + row) * parts + part] = value;
      }
    }
  }
  return whole;
}

/** A quantity of all particles in all frames. */
class Column {
  constructor(facts, whole, rows) {
    Object.assign(this, facts);
    this.whole = whole;
    this.rows = rows;
    this.parts = facts.origin.length;
    this.largest = 2 ** facts.bits - 1;
    this.exact = facts.step.every((step) => step === 1) && !facts.logarithmic;
    this.constant = facts.step.every((step) => step === 0) || (this.exact && facts.shown?.[0] === facts.shown?.[1]);
  }

  /** The column that has a frame; see joined.js. */
  at() {
    return this;
  }

  /** The whole numbers of a frame. */
  frame(frame) {
    const length = this.rows * this.parts, k = this.frames > 1 ? frame : 0;
    return this.whole.subarray(k * length, (k + 1) * length);
  }

  /** The value in a frame and a row; NaN if there is none. */
  value(frame, row, part = 0) {
    return this.meaning(this.frame(frame)[row * this.parts + part], part);
  }

  /** The value that a whole number stands for. */
  meaning(whole, part = 0) {
    if (this.missing && whole === this.largest) return NaN;
    const value = this.origin[part] + this.step[part] * whole;
    return this.logarithmic ? Math.exp(value) : value;
  }

  /** The place of a value on the scale of the whole numbers, not rounded. */
  place(value) {
    const step = this.step[0] || 1;
    return ((this.logarithmic ? Math.log(Math.max(value, 1e-300)) : value) - this.origin[0]) / step;
  }
}

/** The frames of a run. */
class Trajectory {
  /** facts : of the trajectory; data : its zlib streams, one for each column. */
  static async decode(facts, data) {
    const own = new Trajectory();
    Object.assign(own, facts);
    own.columns = {};
    for (let k = 0; k < facts.columns.length; k++) {
      const planes = await inflate(data[k]);
      const whole = undifferenced(facts.columns[k], planes, facts.particles);
      own.columns[facts.columns[k].name] = new Column(facts.columns[k], whole, facts.particles);
    }
    return own;
  }

  get frames() {
    return this.times.length;
  }

  /** The part that has a frame, and the index of the frame in it; see joined.js. */
  at(frame) {
    return { trajectory: this, frame };
  }

  /** The id of the particle in a row; -1 if there is none. */
  id(frame, row) {
    return this.columns.id.value(frame, row);
  }

  /** The row of a particle; -1 if it does not exist in this frame. */
  row(frame, id) {
    return this.columns.id.frame(frame).indexOf(id + 1);
  }

  /** The position of the particle in a row, m. */
  position(frame, row) {
    return [0, 1, 2].map((part) => this.columns.position.value(frame, row, part));
  }

  /** The columns that can be shown as colours. */
  quantities() {
    return Object.values(this.columns).filter(
      (one) => !["id", "position", "orientation"].includes(one.name));
  }
}

/** The contacts of all frames. */
class ContactNetwork {
  static async decode(facts, data) {
    const own = new ContactNetwork(), bytes = await inflate(data), n = facts.intervals;
    const word = (column, k) => {
      let value = 0;
      for (let b = 0; b < 4; b++) value |= bytes[(4 * column + b) * n + k] << (8 * b);
      return value;
    };
    Object.assign(own, facts, { pairs: new Int32Array(4 * n), begin: new Uint32Array(n) });
    own.whole = bytes.subarray(16 * n);
    for (let k = 0, row = 0, begin = 0; k < n; k++) {
      row += word(0, k);
      const first = word(2, k), last = first + word(3, k);
      own.pairs.set([row, row + word(1, k), first, last], 4 * k);
      own.begin[k] = begin;
      begin += last - first + 1;
    }
    return own;
  }

  /** Calls visit(row, row, force in N, repulsion positive) for each contact in a frame. */
  each(frame, visit) {
    for (let k = 0; k < this.begin.length; k++) {
      const first = this.pairs[4 * k + 2], last = this.pairs[4 * k + 3];
      if (first <= frame && frame <= last) {
        const root = this.origin + this.step * this.whole[this.begin[k] + frame - first];
        visit(this.pairs[4 * k], this.pairs[4 * k + 1], root * Math.abs(root));
      }
    }
  }
}

/** The trajectory and the contacts of a run; bytes : its zlib streams, of the lengths in its facts. */
async function decodeRun(facts, bytes) {
  let begin = 0;
  const parts = facts.lengths.map((length) => bytes.subarray(begin, begin += length));
  const trajectory = await Trajectory.decode(facts.trajectory, parts);
  return { trajectory, network: facts.network ? await ContactNetwork.decode(facts.network, parts.at(-1)) : null };
}
