/* A run of which parts are added while it is watched. Each part is a recording of its own, with its own rows,
   scales and scenery; all others see one run. */

/** A quantity in all parts. */
class JoinedColumn {
  constructor(joined, name) {
    Object.assign(this, { joined, name, unit: joined.parts[0].trajectory.columns[name].unit });
  }

  get columns() {
    return this.joined.parts.map((part) => part.trajectory.columns[this.name]).filter(Boolean);
  }

  /** The column of the part that has a frame: its whole numbers are on its own scale. */
  at(frame) {
    return this.joined.at(frame).trajectory.columns[this.name];
  }

  frame(frame) {
    const { trajectory, frame: own } = this.joined.at(frame);
    return trajectory.columns[this.name].frame(own);
  }

  value(frame, row, part = 0) {
    const { trajectory, frame: own } = this.joined.at(frame);
    return trajectory.columns[this.name].value(own, row, part);
  }

  get shown() {
    const ends = this.columns.map((one) => one.shown);
    return [Math.min(...ends.map(([low]) => low)), Math.max(...ends.map(([, high]) => high))];
  }

  get constant() {
    const [low, high] = this.shown, values = this.columns.map((one) => one.meaning(one.whole[0]));
    return this.columns.every((one) => one.constant) && low === high && values.every((value) => value === values[0]);
  }

  get exact() {
    return this.columns.every((one) => one.exact);
  }

  get logarithmic() {
    return this.columns.every((one) => one.logarithmic);
  }

  get step() {
    return this.columns[0].step;
  }
}

class JoinedTrajectory {
  /** run : a trajectory with its contacts; scene : what is drawn beside its particles. */
  constructor(run, scene) {
    this.replace(run, scene);
  }

  replace(run, scene) {
    Object.assign(this, { parts: [], places: [], times: [], counts: [], indices: [], columns: {} });
    this.add(run, scene);
  }

  /** Adds a part; returns whether it has all quantities. */
  add({ trajectory, network }, scene) {
    const part = { trajectory, network, scene };
    this.parts.push(part);
    for (let frame = 0; frame < trajectory.frames; frame++) {
      this.places.push({ ...part, frame });
      this.times.push(trajectory.times[frame]);
      this.counts.push(trajectory.counts[frame]);
      this.indices.push(trajectory.indices[frame]);
    }
    if (this.parts.length === 1) {
      for (const name of Object.keys(trajectory.columns)) this.columns[name] = new JoinedColumn(this, name);
    }
    return Object.keys(this.columns).every((name) => trajectory.columns[name]);
  }

  get frames() {
    return this.times.length;
  }

  get particles() {
    return Math.max(...this.parts.map((part) => part.trajectory.particles));
  }

  /** The bytes of all decoded numbers. */
  get bytes() {
    return this.parts.reduce((sum, part) => sum + Object.values(part.trajectory.columns).reduce((own, one) => own + one.whole.byteLength, 0), 0);
  }

  /** The part that has a frame, and the index of the frame in it. */
  at(frame) {
    return this.places[frame];
  }

  id(frame, row) {
    const { trajectory, frame: own } = this.at(frame);
    return row < trajectory.particles ? trajectory.id(own, row) : -1;
  }

  row(frame, id) {
    const { trajectory, frame: own } = this.at(frame);
    return trajectory.row(own, id);
  }

  position(frame, row) {
    const { trajectory, frame: own } = this.at(frame);
    return trajectory.position(own, row);
  }

  quantities() {
    return Object.values(this.columns).filter((one) => !["id", "position", "orientation"].includes(one.name));
  }
}
