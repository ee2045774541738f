/* A viewer of particles in WebGL2. Each particle is a square turned to the camera, on which the fragment
   shader casts the ray of the pixel at a sphere, a rod, a superquadric or a cylinder. A second pass darkens
   pixels behind nearer ones, which draws outlines and makes depth visible (eye-dome lighting: C. Boucheny,
   thesis, Universite Joseph Fourier, Grenoble, 2009).

   Lengths in shaders are relative to the size of the view, so that single precision suffices at any scale. */

const SHARED = `#version 300 es
precision highp float; precision highp int;
uniform mat4 view, projection;
uniform bool flat_;          // without perspective
uniform vec4 cut;            // clipping plane in view space: kept where dot(cut.xyz, r) < cut.w
uniform bool cutting;
`;

const BODY_VERTEX = SHARED + `
layout(location = 0) in vec2 corner;
layout(location = 1) in vec3 place;
layout(location = 2) in float size;
layout(location = 3) in float value;
layout(location = 4) in vec4 turn;
layout(location = 5) in float kind;
layout(location = 6) in float present;
uniform vec3 origin, step_;
uniform vec2 sizes;          // radius = sizes.x + sizes.y * size, or its exponential
uniform bool sizesLogarithmic;
uniform vec2 colours;        // place on the map = (value - colours.x) * colours.y
uniform float missing, leastRadius, pixel;
uniform bool turned;
uniform sampler2D shapes;    // two texels a shape: family, a, b, c; exponents, bounding radius
out vec3 at;
flat out vec3 centre;
flat out vec4 first, second;
flat out float radius, shade;
flat out mat3 body;
flat out uint index;
mat3 rotation(vec4 q) {
  vec3 x = q.xyz; float w = q.w;
  return mat3(1.0 - 2.0 * (x.y * x.y + x.z * x.z), 2.0 * (x.x * x.y + w * x.z), 2.0 * (x.x * x.z - w * x.y),
              2.0 * (x.x * x.y - w * x.z), 1.0 - 2.0 * (x.x * x.x + x.z * x.z), 2.0 * (x.y * x.z + w * x.x),
              2.0 * (x.x * x.z + w * x.y), 2.0 * (x.y * x.z - w * x.x), 1.0 - 2.0 * (x.x * x.x + x.y * x.y));
}
void main() {
  index = uint(gl_InstanceID) + 1u;
  centre = (view * vec4(origin + step_ * place, 1.0)).xyz;
  radius = sizes.x + sizes.y * size;
  if (sizesLogarithmic) radius = exp(radius);
  float away = flat_ ? 1.0 : length(centre);
  radius = max(radius, leastRadius * pixel * away);
  shade = value == missing ? -1.0 : clamp((value - colours.x) * colours.y, 0.0, 1.0);
  int row = int(kind + 0.5);
  first = texelFetch(shapes, ivec2(0, row), 0);
  second = texelFetch(shapes, ivec2(1, row), 0);
  body = mat3(1.0);
  if (turned) {
    vec4 q = normalize(turn * (2.0 / 65535.0) - 1.0);   // w, x, y, z
    body = mat3(view) * rotation(vec4(q.yzw, q.x));
  }
  if (present < 0.5 || radius <= 0.0 || (!flat_ && away <= radius)) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    return;
  }
  vec3 right = vec3(1.0, 0.0, 0.0), up = vec3(0.0, 1.0, 0.0);
  float half_ = radius;
  if (!flat_) {
    vec3 ahead = centre / away;
    right = normalize(cross(ahead, vec3(0.0, 1.0, 0.001)));
    up = cross(right, ahead);
    half_ = radius * away / sqrt(away * away - radius * radius);
  }
  at = centre + half_ * (corner.x * right + corner.y * up);
  gl_Position = projection * vec4(at, 1.0);
}`;

/* SPHERES is 1 for scenes whose particles are all spheres. */
const BODY_FRAGMENT = SHARED + `
in vec3 at;
flat in vec3 centre;
flat in vec4 first, second;
flat in float radius, shade;
flat in mat3 body;
flat in uint index;
uniform sampler2D map;
uniform vec4 plain;          // a colour for all bodies, if its alpha is 1
uniform uint chosen, beyond;
uniform float opacity;
layout(location = 0) out vec4 colour;
layout(location = 1) out uint picked;
const vec2 NONE = vec2(1.0, -1.0);
vec2 common_(vec2 a, vec2 b) { return vec2(max(a.x, b.x), min(a.y, b.y)); }
vec2 ball(vec3 o, vec3 d, float r) {
  float b = dot(o, d);
  vec3 foot = o - b * d;
  float h = r * r - dot(foot, foot);
  return h < 0.0 ? NONE : vec2(-b - sqrt(h), -b + sqrt(h));
}
#if !SPHERES
vec2 tube(vec3 o, vec3 d, float r, float half_) {   // along z, with flat ends
  float a = dot(d.xy, d.xy), b = dot(o.xy, d.xy), c = dot(o.xy, o.xy) - r * r, h = b * b - a * c;
  if (h < 0.0 || (a < 1e-12 && c > 0.0)) return NONE;
  vec2 side = a < 1e-12 ? vec2(-1e9, 1e9) : vec2(-b - sqrt(h), -b + sqrt(h)) / a;
  float slope = abs(d.z) < 1e-9 ? 1e-9 : d.z;
  vec2 ends = vec2(-half_ - o.z, half_ - o.z) / slope;
  return common_(side, vec2(min(ends.x, ends.y), max(ends.x, ends.y)));
}
vec2 rod(vec3 o, vec3 d, float r, float half_) {    // along z, with half spheres
  vec3 end = vec3(0.0, 0.0, half_);
  vec2 both = NONE, part;
  for (int k = 0; k < 3; k++) {
    part = k == 0 ? tube(o, d, r, half_) : ball(k == 1 ? o - end : o + end, d, r);
    if (part.x < part.y) both = both.x > both.y ? part : vec2(min(both.x, part.x), max(both.y, part.y));
  }
  return both;
}
vec3 slope(vec3 p, vec3 a, vec3 g) {
  return sign(p) * g / a * pow(max(abs(p / a), 1e-5), g - 1.0);
}
/* Newton's method from outside: the level is convex along a ray, so that it converges from one side. */
float reach(vec3 o, vec3 d, float s, vec3 a, vec3 g) {
  for (int k = 0; k < 40; k++) {
    vec3 p = o + s * d;
    float level = dot(pow(max(abs(p / a), 1e-5), g), vec3(1.0)) - 1.0;
    if (level < 1e-4) return s;
    float rate = dot(slope(p, a, g), d);
    if (rate >= 0.0) return 1e9;
    s -= level / rate;
  }
  return s;
}
vec2 superquadric(vec3 o, vec3 d, vec3 a, vec3 g) {
  vec3 t0 = (-a - o) / d, t1 = (a - o) / d, low = min(t0, t1), high = max(t0, t1);
  vec2 box = vec2(max(max(low.x, low.y), low.z), min(min(high.x, high.y), high.z));
  if (box.x > box.y) return NONE;
  float begin = reach(o, d, box.x, a, g);
  return begin > box.y ? NONE : vec2(begin, -reach(o, -d, -box.y, a, g));
}
#endif
void main() {
  vec3 from = flat_ ? vec3(at.xy, 0.0) : vec3(0.0), ray = flat_ ? vec3(0.0, 0.0, -1.0) : normalize(at);
  // Lengths relative to the radius, from the point of the ray nearest to the centre.
  float near = dot(centre - from, ray);
  vec3 o = (from + near * ray - centre) / radius;
#if SPHERES
  vec2 t = ball(o, ray, 1.0);
#else
  vec3 own = transpose(body) * o, d = transpose(body) * ray, a = first.yzw / second.w, g = second.xyz;
  int family = int(first.x + 0.5);
  vec2 t = NONE;
  if (family == 0) t = ball(own, d, 1.0);
  else if (family == 1) t = rod(own, d, a.x, a.z);
  else if (family == 2) t = superquadric(own, d, a, g);
  else t = tube(own, d, a.x, a.z);
#endif
  if (t.x > t.y) discard;
  bool capped = false;
  if (cutting) {
    float beside = dot(cut.xyz, from + near * ray) - cut.w, rate = dot(cut.xyz, ray) * radius;
    float s = abs(rate) < 1e-12 ? (beside > 0.0 ? 1e9 : -1e9) : -beside / rate;
    if (rate >= 0.0) t.y = min(t.y, s);
    else if (s > t.x) { t.x = s; capped = true; }
    if (t.x >= t.y) discard;
  }
  vec3 hit = from + (near + t.x * radius) * ray;
  if (hit.z > -1e-4) discard;
#if SPHERES
  vec3 normal = o + t.x * ray;
#else
  vec3 p = own + t.x * d, n;
  if (family == 0) n = p;
  else if (family == 1) n = p - vec3(0.0, 0.0, clamp(p.z, -a.z, a.z));
  else if (family == 2) n = slope(p, a, g);
  else n = abs(p.z) > a.z * 0.9999 ? vec3(0.0, 0.0, p.z) : vec3(p.xy, 0.0);
  vec3 normal = body * n;
#endif
  normal = capped ? cut.xyz : normalize(normal);
  vec3 base = plain.a > 0.5 ? plain.rgb : shade < 0.0 ? vec3(0.55) : texture(map, vec2(shade, 0.5)).rgb;
  float lit = max(dot(normal, vec3(-0.42, 0.57, 0.71)), 0.0), sky = 0.5 + 0.5 * normal.y;
  vec3 bent = reflect(ray, normal);
  float gloss = pow(max(dot(bent, vec3(-0.42, 0.57, 0.71)), 0.0), 24.0);
  vec3 shown = base * (0.34 + 0.16 * sky + 0.62 * lit) + 0.16 * gloss;
  if (capped) shown = base * 0.72;
  if (index == chosen) shown = mix(shown, vec3(1.0, 0.25, 0.55), 0.65);
  colour = vec4(shown, opacity);
  picked = index + beyond;
  vec4 clip = projection * vec4(hit, 1.0);
  gl_FragDepth = 0.5 * clip.z / clip.w + 0.5;
}`;

const LINE_VERTEX = SHARED + `
layout(location = 0) in vec2 corner;
layout(location = 1) in vec3 start;
layout(location = 2) in vec3 end;
layout(location = 3) in float weight;
uniform mat4 pose;
uniform vec2 screen;
uniform vec2 width;          // pixels: width.x + width.y * |weight|
uniform vec4 weak, plain, pull; // colours at the weights 0, 1 and -1
out float across, half_;      // pixels from the middle of the line, and half its width
out vec4 ink;
out vec3 at;
void main() {
  vec3 a = (view * pose * vec4(start, 1.0)).xyz, b = (view * pose * vec4(end, 1.0)).xyz;
  if (!flat_) {               // the part in front of the camera
    float near = -1e-3;
    if (a.z > near && b.z > near) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
    if (a.z > near) a = mix(b, a, (near - b.z) / (a.z - b.z));
    if (b.z > near) b = mix(a, b, (near - a.z) / (b.z - a.z));
  }
  vec4 p = projection * vec4(a, 1.0), q = projection * vec4(b, 1.0), r = corner.x < 0.0 ? p : q;
  vec2 way = (q.xy / q.w - p.xy / p.w) * screen;
  way = length(way) > 1e-6 ? normalize(way) : vec2(1.0, 0.0);
  half_ = 0.5 * (width.x + width.y * abs(weight));
  ink = mix(weak, weight < 0.0 ? pull : plain, abs(weight));
  across = corner.y * (half_ + 1.0);
  vec2 aside = vec2(-way.y, way.x) * 2.0 * across / screen;
  at = corner.x < 0.0 ? a : b;
  gl_Position = vec4(r.xy + aside * r.w, r.zw);
}`;

const LINE_FRAGMENT = SHARED + `
in float across, half_;
in vec3 at;
in vec4 ink;
layout(location = 0) out vec4 colour;
void main() {
  if (cutting && dot(cut.xyz, at) > cut.w) discard;
  colour = vec4(ink.rgb, ink.a * clamp(half_ + 0.5 - abs(across), 0.0, 1.0) * min(2.0 * half_, 1.0));
}`;

const WALL_VERTEX = SHARED + `
layout(location = 0) in vec3 place;
layout(location = 1) in vec3 normal;
uniform mat4 pose;
out vec3 at;
flat out vec3 outward;
void main() {
  outward = normalize(mat3(view) * mat3(pose) * normal);
  at = (view * pose * vec4(place, 1.0)).xyz;
  gl_Position = projection * vec4(at, 1.0);
}`;

const WALL_FRAGMENT = SHARED + `
in vec3 at;
flat in vec3 outward;
uniform vec4 plain;
layout(location = 0) out vec4 colour;
void main() {
  if (cutting && dot(cut.xyz, at) > cut.w) discard;
  vec3 ray = flat_ ? vec3(0.0, 0.0, -1.0) : normalize(at);
  float edge = 1.0 - abs(dot(outward, ray));         // more opaque at grazing angles, as glass is
  colour = vec4(plain.rgb, plain.a * (0.6 + 1.8 * edge * edge));
}`;

const SCREEN_VERTEX = `#version 300 es
layout(location = 0) in vec2 corner;
void main() { gl_Position = vec4(corner, 0.0, 1.0); }`;

const SCREEN_FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D image, depth;
uniform vec4 lens;           // projection[2][2], projection[3][2], 1 without perspective, depth of a dark edge
uniform vec3 low, high;      // background
uniform float strength, wide;
uniform int samples;         // pixels of the image along a side of a pixel of the screen
out vec4 colour;
float distance_(ivec2 p) {
  float z = 2.0 * texelFetch(depth, clamp(p, ivec2(0), textureSize(depth, 0) - 1), 0).r - 1.0;
  return lens.z > 0.5 ? (lens.y - z) / lens.x : lens.y / (z + lens.x);
}
float response(ivec2 p, float here, float reach, float turn) {
  float sum = 0.0;
  for (int k = 0; k < 8; k++) {
    float angle = 0.785398 * float(k) + turn;
    float nearer = (here - distance_(p + ivec2(round(reach * vec2(cos(angle), sin(angle)))))) / lens.w;
    sum += nearer > 0.0 ? nearer / (1.0 + 0.25 * nearer * nearer) : 0.0;
  }
  return sum / 8.0;
}
void main() {
  ivec2 size = textureSize(image, 0), first = ivec2(gl_FragCoord.xy) * samples;
  vec3 ground = mix(low, high, gl_FragCoord.y * float(samples) / float(size.y)), sum = vec3(0.0);
  for (int k = 0; k < samples * samples; k++) {
    ivec2 p = min(first + ivec2(k % samples, k / samples), size - 1);
    vec4 here = texelFetch(image, p, 0);
    float z = texelFetch(depth, p, 0).r, dark = 1.0;
    if (z < 1.0 && strength > 0.0) {
      float away = distance_(p), scale = float(samples);
      // Other directions and lengths for each of the pixels that are averaged.
      float turn = fract(0.61803 * float(k) + 0.5 * float((p.x ^ p.y) & 1)), longer = 0.75 + 0.5 * turn;
      float edge = response(p, away, 1.2 * scale, 0.0) + 0.8 * response(p, away, longer * wide * scale, turn)
        + 0.5 * response(p, away, 2.6 * longer * wide * scale, 2.0 * turn);
      dark = exp(-strength * edge);
    }
    sum += mix(ground, here.rgb / max(here.a, 1e-3) * dark, here.a);
  }
  colour = vec4(sum / float(samples * samples), 1.0);
}`;

const Matrix = {
  product(a, b) {
    const c = new Float32Array(16);
    for (let i = 0; i < 4; i++) for (let j = 0; j < 4; j++) {
      for (let k = 0; k < 4; k++) c[4 * j + i] += a[4 * k + i] * b[4 * j + k];
    }
    return c;
  },
  /** A translation and a quaternion x, y, z, w. */
  pose([a, b, c, x, y, z, w]) {
    return new Float32Array([
      1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y), 0,
      2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x), 0,
      2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y), 0, a, b, c, 1]);
  },
};

const FIELD_OF_VIEW = 26 * Math.PI / 180;
const CORNERS = new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]);
const LEAST_PIXELS = 1.6;       // radius of a particle on the screen, so that it is visible
/* Weak, repulsive and attractive contacts, on a bright and on a dark ground. */
const FORCE_COLOURS = [
  { weak: [0.66, 0.66, 0.64], strong: [0.78, 0.12, 0.04], pull: [0.08, 0.30, 0.78] },
  { weak: [0.34, 0.37, 0.42], strong: [1.0, 0.66, 0.16], pull: [0.35, 0.68, 1.0] }];
const BESIDE_CONTACTS = 0.2;    // radius of a particle, over its own, so that its contacts are visible
const ONLY_TOUCHING = 0.4;      // weight of contacts whose force is not known
const FIRST_VIEW = { azimuth: -62 * Math.PI / 180, elevation: 18 * Math.PI / 180 };

class Viewer {
  /** canvas : to draw on; trajectory, network : decoded; scene : box, bodies, magnets, shapes, focus. */
  constructor(canvas, trajectory, scene, network) {
    Object.assign(this, { canvas, trajectory, scene, network });
    const gl = canvas.getContext("webgl2", { alpha: false, antialias: false });
    if (!gl) throw new Error("This browser has no WebGL2, which the view in three dimensions needs.");
    this.gl = gl;
    this.frame = 0;
    this.part = trajectory.at(0);
    this.chosen = -1;
    this.options = {
      colour: null, range: [0, 1], map: null, size: null, scale: 1, flat: false, walls: true, magnets: "solid",
      box: true, lines: true, contacts: false, outlines: true, cut: null, dark: false,
    };
    const { low, high } = scene.focus;
    this.centre = low.map((x, k) => (x + high[k]) / 2);
    this.unit = Math.hypot(...low.map((x, k) => high[k] - x)) / 2 || 1;
    this.reachable = Math.max(1, ...[scene.low, scene.high].map((r) => Math.hypot(...this.relative(r)))) * 1.4;
    this.home();
    this.listeners = [];
    this.build();
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => { this.build(); this.show(this.frame); });
  }

  relative(r) {
    return r.map((x, k) => (x - this.centre[k]) / this.unit);
  }

  home() {
    const { low, high } = this.scene.focus, size = Math.hypot(...low.map((x, k) => high[k] - x)) / 2 || this.unit;
    const distance = 0.94 / Math.sin(FIELD_OF_VIEW / 2) * size / this.unit;
    this.camera = { ...FIRST_VIEW, distance, target: this.relative(low.map((x, k) => (x + high[k]) / 2)) };
    this.invalidate();
  }

  /** Takes over what a later part of the run has beside its particles; the camera stays. */
  extend(scene) {
    const { focus } = this.scene, wider = (name, choose) => scene.focus[name].some((x, k) => choose(x, focus[name][k]) !== focus[name][k]);
    const grown = wider("low", Math.min) || wider("high", Math.max);
    focus.low = focus.low.map((x, k) => Math.min(x, scene.focus.low[k]));
    focus.high = focus.high.map((x, k) => Math.max(x, scene.focus.high[k]));
    this.reachable = Math.max(this.reachable, ...[scene.low, scene.high].map((r) => 1.4 * Math.hypot(...this.relative(r))));
    // The planes of walls end around the particles.
    if (grown) this.bodies = scene.bodies.map((body, k) => ({ ...this.buildBody(body), k }));
  }

  // Building

  program(vertex, fragment) {
    const gl = this.gl, program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    const places = {};
    for (let k = 0; k < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); k++) {
      const { name } = gl.getActiveUniform(program, k);
      places[name] = gl.getUniformLocation(program, name);
    }
    return { program, places };
  }

  build() {
    const gl = this.gl;
    const spheres = (only) => BODY_FRAGMENT.replace("#version 300 es", `#version 300 es\n#define SPHERES ${only}`);
    const shaped = this.scene.shapes.length > 0;
    this.programs = {
      particles: this.program(BODY_VERTEX, spheres(shaped ? 0 : 1)),
      magnets: this.scene.magnets.length ? this.program(BODY_VERTEX, spheres(0)) : null,
      lines: this.program(LINE_VERTEX, LINE_FRAGMENT),
      walls: this.program(WALL_VERTEX, WALL_FRAGMENT),
      screen: this.program(SCREEN_VERTEX, SCREEN_FRAGMENT),
    };
    this.colourMap = this.texture();
    this.square = this.vertexArray([[0, CORNERS, 2, 0]]);
    this.particles = this.vertexArray([[0, CORNERS, 2, 0]]);
    this.particles.shapes = this.shapeTable(this.scene.shapes);
    this.buildMagnets();
    this.bodies = this.scene.bodies.map((body, k) => ({ ...this.buildBody(body), k }));
    this.boxLines = this.lines(this.boxEdges());
    this.contactLines = this.lines([]);
    this.fieldLines = this.lines((this.scene.lines?.ends ?? []).map((x, k) => (x - this.centre[k % 3]) / this.unit));
    this.image = null;
    if (this.options.map) this.setMap(this.options.map, this.options.discrete);
  }

  texture() {
    const gl = this.gl, texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
    for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 1, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array([120, 120, 120, 255]));
    return texture;
  }

  /** Attributes [location, values, components, divisor]. */
  vertexArray(attributes) {
    const own = { array: this.gl.createVertexArray(), buffers: {} };
    for (const [location, values, parts, divisor] of attributes) this.attribute(own, location, values, parts, divisor);
    return own;
  }

  attribute(own, location, values, parts, divisor = 1) {
    const gl = this.gl, types = new Map([[Uint8Array, gl.UNSIGNED_BYTE], [Uint16Array, gl.UNSIGNED_SHORT],
      [Uint32Array, gl.UNSIGNED_INT], [Float32Array, gl.FLOAT]]);
    own.buffers[location] ??= gl.createBuffer();
    gl.bindVertexArray(own.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, own.buffers[location]);
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW);
    gl.enableVertexAttribArray(location);
    gl.vertexAttribPointer(location, parts, types.get(values.constructor), false, 0, 0);
    gl.vertexAttribDivisor(location, divisor);
  }

  /** Families 0 to 3: sphere, rod, superquadric, cylinder; see the vertex shader. */
  shapeTable(shapes) {
    const gl = this.gl, texture = this.texture();
    const rows = shapes.length ? shapes : [{ family: 0, axes: [1, 1, 1], exponents: [2, 2, 2], radius: 1 }];
    const data = new Float32Array(8 * rows.length);
    rows.forEach((one, k) => data.set([one.family, ...one.axes, ...one.exponents, one.radius], 8 * k));
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, 2, rows.length, 0, gl.RGBA, gl.FLOAT, data);
    return texture;
  }

  buildMagnets() {
    const magnets = this.scene.magnets, shapes = [], turns = [], sizes = [];
    for (const one of magnets) {
      const half = one.length / 2, bound = Math.hypot(one.radius, half);
      const radius = one.length ? bound : one.radius;
      shapes.push({ family: one.length ? 3 : 0, axes: [one.radius, 0, half], exponents: [2, 2, 2], radius });
      sizes.push(radius / this.unit);
      const [x, y, z] = one.axis;           // the rotation from z to the axis
      const turn = z < -0.999999 ? [0, 1, 0, 0] : [1 + z, -y, x, 0], length = Math.hypot(...turn);
      turns.push(...turn.map((q) => (q / length + 1) * 32767.5));
    }
    if (!magnets.length) return;
    this.magnets = this.vertexArray([[0, CORNERS, 2, 0],
      [1, new Float32Array(magnets.flatMap((one) => this.relative(one.centre))), 3, 1],
      [2, new Float32Array(sizes), 1, 1], [4, new Float32Array(turns), 4, 1],
      [5, new Float32Array(sizes.map((_, k) => k)), 1, 1]]);
    this.magnets.shapes = this.shapeTable(shapes);
  }

  buildBody(body) {
    const corner = (k) => this.relative(body.vertices.slice(3 * k, 3 * k + 3)), places = [], normals = [];
    for (let m = 0; m < body.triangles.length; m += 3) {
      const [a, b, c] = body.triangles.slice(m, m + 3).map(corner);
      const [p, q] = [b, c].map((end) => end.map((x, k) => x - a[k]));
      const normal = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
      const size = Math.hypot(...normal) || 1;
      places.push(...a, ...b, ...c);
      for (let k = 0; k < 3; k++) normals.push(...normal.map((x) => x / size));
    }
    const own = this.vertexArray([[0, new Float32Array(places), 3, 0], [1, new Float32Array(normals), 3, 0]]);
    const ends = [];
    for (const k of body.lines) ends.push(...corner(k));
    return { ...own, count: places.length / 3, lines: this.lines(ends) };
  }

  /** ends : three coordinates of both ends of each line, relative. */
  lines(ends, weights = null, own = null) {
    const n = ends.length / 6, start = new Float32Array(3 * n), end = new Float32Array(3 * n);
    for (let k = 0; k < n; k++) for (let m = 0; m < 3; m++) {
      start[3 * k + m] = ends[6 * k + m];
      end[3 * k + m] = ends[6 * k + 3 + m];
    }
    own ??= this.vertexArray([[0, CORNERS, 2, 0]]);
    this.attribute(own, 1, start, 3);
    this.attribute(own, 2, end, 3);
    this.attribute(own, 3, weights ?? new Float32Array(n), 1);
    own.count = n;
    return own;
  }

  /** The scene of the part that is shown. */
  around() {
    return this.part.scene ?? this.scene;
  }

  edges() {
    const { edges } = this.around().box;
    return edges[Math.min(this.part.frame, edges.length - 1)];
  }

  boxEdges() {
    const { box } = this.scene, ends = [];
    if (!box) return ends;
    const edges = this.edges();
    const corner = (k) => this.relative(box.origin.map((x, m) => x + [0, 1, 2].reduce(
      (sum, axis) => sum + (k >> axis & 1) * edges[axis][m], 0)));
    for (let a = 0; a < 8; a++) for (let axis = 0; axis < 3; axis++) {
      if (!(a >> axis & 1)) ends.push(...corner(a), ...corner(a | 1 << axis));
    }
    return ends;
  }

  // Frames and colours

  /** Shows a frame. */
  show(frame) {
    this.frame = frame;
    const before = this.part.trajectory;
    this.part = this.trajectory.at(frame);
    const { options, particles, particles: { buffers }, part: { trajectory, frame: own } } = this, other = trajectory !== before;
    const { position, id, orientation, shape } = trajectory.columns;
    this.attribute(particles, 1, position.frame(own), 3);
    if (id.frames > 1 || !buffers[6] || other) {
      this.attribute(particles, 6, Uint8Array.from(id.frame(own), (one) => (one > 0 ? 1 : 0)), 1);
    }
    if (orientation && (orientation.frames > 1 || !buffers[4] || other)) this.attribute(particles, 4, orientation.frame(own), 4);
    if (shape && (shape.frames > 1 || !buffers[5] || other)) {
      this.attribute(particles, 5, Uint8Array.from(shape.frame(own), (one) => one + shape.origin[0]), 1);
    }
    const size = trajectory.columns[options.size] ?? trajectory.columns.radius;
    this.attribute(particles, 2, size.frame(own), 1);
    const colour = trajectory.columns[options.colour];
    if (colour) this.attribute(particles, 3, colour.frame(own), 1);
    if (this.scene.box && (this.around().box.edges.length > 1 || other)) this.lines(this.boxEdges(), null, this.boxLines);
    this.findContacts();
    this.invalidate();
  }

  /** The contacts of the part that is shown; null if it has none. */
  contacts() {
    return "network" in this.part ? this.part.network : this.network;
  }

  networks() {
    return (this.trajectory.parts ?? [this]).map((part) => part.network).filter(Boolean);
  }

  /** The force (N) of the strongest colour; 0 if forces are not known. */
  usualForce() {
    return Math.max(0, ...this.networks().map((one) => one.usual));
  }

  /** Whether some contacts attract. */
  attracts() {
    return this.networks().some((one) => one.origin < 0);
  }

  findContacts() {
    const network = this.contacts(), usual = this.usualForce();
    if (!network || !this.options.contacts) return this.lines([], null, this.contactLines);
    const found = [], box = this.scene.box;
    const rows = box ? this.edges().map((edge, k) => (box.periodic[k] ? edge : null)) : [null, null, null];
    const order = [0, 1, 2].sort((a, b) => (rows[b] ?? []).filter(Boolean).length - (rows[a] ?? []).filter(Boolean).length);
    network.each(this.part.frame, (i, j, force) => {
      const a = this.trajectory.position(this.frame, i), b = this.trajectory.position(this.frame, j);
      for (const axis of order) {
        if (!rows[axis]) continue;
        const turns = Math.round((b[axis] - a[axis]) / rows[axis][axis]);
        for (let m = 0; m < 3; m++) b[m] -= turns * rows[axis][m];
      }
      const weight = usual ? Math.max(-1, Math.min(1, force / usual)) : ONLY_TOUCHING;
      found.push({ weight, ends: [...this.relative(a), ...this.relative(b)] });
    });
    // The strongest are drawn last, over the others.
    found.sort((a, b) => Math.abs(a.weight) - Math.abs(b.weight));
    this.lines(found.flatMap((one) => one.ends), Float32Array.from(found, (one) => one.weight), this.contactLines);
  }

  forceColours() {
    return FORCE_COLOURS[Number(this.options.dark)];
  }

  /** Colours [r, g, b] in 0..255 of a map; discrete for classes. */
  setMap(map, discrete = false) {
    const gl = this.gl, data = new Uint8Array(4 * map.length).fill(255);
    map.forEach((rgb, k) => data.set(rgb, 4 * k));
    Object.assign(this.options, { map, discrete });
    gl.bindTexture(gl.TEXTURE_2D, this.colourMap);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, map.length, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, data);
    for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
      gl.texParameteri(gl.TEXTURE_2D, side, discrete ? gl.NEAREST : gl.LINEAR);
    }
    this.invalidate();
  }

  set(options) {
    Object.assign(this.options, options);
    if (["colour", "size", "contacts"].some((name) => name in options)) this.show(this.frame);
    this.invalidate();
  }

  // Drawing

  invalidate() {
    if (this.asked || !this.programs) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      if (this.programs) this.draw(this.moving ? 1 : this.bestSamples());
    });
  }

  /** Draws coarsely until nothing has moved for a moment. */
  touch() {
    this.moving = true;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => { this.moving = false; this.invalidate(); }, 180);
    this.invalidate();
  }

  /** Gives its memory on the graphics card back; nothing is drawn any more. */
  release() {
    clearTimeout(this.timer);
    this.programs = null;
    this.gl.getExtension("WEBGL_lose_context")?.loseContext();
  }

  bestSamples() {
    return this.canvas.width * this.canvas.height < 2.2e6 && devicePixelRatio < 2 ? 2 : 1;
  }

  axes() {
    const { azimuth: a, elevation: e } = this.camera;
    const towards = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
    const right = [-Math.sin(a), Math.cos(a), 0];
    const up = [-Math.sin(e) * Math.cos(a), -Math.sin(e) * Math.sin(a), Math.cos(e)];
    return { right, up, towards };
  }

  /** The matrices of the camera, and the length of a pixel at the target or, with perspective, at length 1. */
  lens() {
    const { camera, options, reachable } = this, { right, up, towards } = this.axes();
    const aspect = this.canvas.width / this.canvas.height, tangent = Math.tan(FIELD_OF_VIEW / 2);
    const narrow = tangent * Math.max(1, 1 / aspect), extent = reachable + Math.hypot(...camera.target);
    const away = options.flat ? camera.distance + 2 * extent : camera.distance;
    const eye = camera.target.map((x, k) => x + away * towards[k]);
    const dot = (a) => -(a[0] * eye[0] + a[1] * eye[1] + a[2] * eye[2]);
    const view = new Float32Array([right[0], up[0], towards[0], 0, right[1], up[1], towards[1], 0,
      right[2], up[2], towards[2], 0, dot(right), dot(up), dot(towards), 1]);
    const near = Math.max(away - extent, 0.004 * away), far = away + extent, projection = new Float32Array(16);
    if (options.flat) {
      const half = narrow * camera.distance;
      projection.set([1 / (half * aspect), 0, 0, 0, 0, 1 / half, 0, 0, 0, 0, -2 / (far - near), 0,
        0, 0, -(far + near) / (far - near), 1]);
    } else {
      projection.set([1 / (narrow * aspect), 0, 0, 0, 0, 1 / narrow, 0, 0, 0, 0, -(far + near) / (far - near), -1,
        0, 0, -2 * far * near / (far - near), 0]);
    }
    const pixel = 2 * narrow / this.canvas.height * (options.flat ? camera.distance : 1);
    return { view, projection, pixel, away };
  }

  target(width, height) {
    const gl = this.gl;
    if (this.image && this.image.width === width && this.image.height === height) return this.image;
    if (this.image) {
      gl.deleteFramebuffer(this.image.buffer);
      for (const texture of this.image.textures) gl.deleteTexture(texture);
    }
    const buffer = gl.createFramebuffer(), kinds = [
      [gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, gl.COLOR_ATTACHMENT0],
      [gl.R32UI, gl.RED_INTEGER, gl.UNSIGNED_INT, gl.COLOR_ATTACHMENT1],
      [gl.DEPTH_COMPONENT24, gl.DEPTH_COMPONENT, gl.UNSIGNED_INT, gl.DEPTH_ATTACHMENT]];
    gl.bindFramebuffer(gl.FRAMEBUFFER, buffer);
    const textures = kinds.map(([inner, outer, type, place]) => {
      const texture = this.texture();
      gl.texImage2D(gl.TEXTURE_2D, 0, inner, width, height, 0, outer, type, null);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, place, gl.TEXTURE_2D, texture, 0);
      return texture;
    });
    this.image = { buffer, textures, width, height };
    return this.image;
  }

  use(name, lens) {
    const gl = this.gl, { program, places } = this.programs[name], { options } = this;
    gl.useProgram(program);
    gl.uniformMatrix4fv(places.view, false, lens.view);
    gl.uniformMatrix4fv(places.projection, false, lens.projection);
    gl.uniform1i(places.flat_, options.flat);
    gl.uniform1i(places.cutting, options.cut !== null);
    if (options.cut) {
      // The plane n.r = d, with r relative, in view space.
      const { normal, distance } = options.cut, v = lens.view;
      const n = [0, 1, 2].map((m) => v[m] * normal[0] + v[4 + m] * normal[1] + v[8 + m] * normal[2]);
      const centre = normal.reduce((sum, x, k) => sum + x * this.centre[k], 0);
      const shift = n.reduce((sum, x, m) => sum + x * v[12 + m], 0);
      gl.uniform4f(places.cut, ...n, (distance - centre) / this.unit + shift);
    }
    return places;
  }

  draw(samples = 1) {
    const { gl, canvas, options } = this;
    if (!this.programs || !canvas.width || !canvas.height) return;
    const lens = this.lens(), width = canvas.width * samples, height = canvas.height * samples;
    const image = this.target(width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, image.buffer);
    gl.viewport(0, 0, width, height);
    gl.drawBuffers([gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1]);
    gl.clearBufferfv(gl.COLOR, 0, [0, 0, 0, 0]);
    gl.clearBufferuiv(gl.COLOR, 1, [0, 0, 0, 0]);
    gl.clearBufferfv(gl.DEPTH, 0, [1]);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    this.drawParticles(lens, samples);
    if (this.magnets && options.magnets === "solid") this.drawMagnets(lens, 1);
    // Lines and walls cover pixels in part, and cannot be picked.
    gl.drawBuffers([gl.COLOR_ATTACHMENT0, gl.NONE]);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    if (this.magnets && options.magnets === "glass") this.drawMagnets(lens, 0.22);
    if (options.walls) this.drawWalls(lens);
    this.drawLines(lens, samples);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    this.finish(lens, samples, image);
    for (const listener of this.listeners) listener(lens);
  }

  drawParticles(lens, samples) {
    const { gl, options, part: { trajectory } } = this, places = this.use("particles", lens);
    const { position, radius, orientation } = trajectory.columns, colour = trajectory.columns[options.colour];
    const factor = options.scale * (options.contacts && this.contacts() ? BESIDE_CONTACTS : 1);
    gl.uniform3fv(places.origin, this.relative(position.origin));
    gl.uniform3fv(places.step_, position.step.map((step) => step / this.unit));
    const other = options.size && options.size !== "radius" ? trajectory.columns[options.size] : null;
    if (other) {
      const largest = this.scene.medianRadius / this.unit * factor * 1.6, [low, high] = this.trajectory.columns[options.size].shown.map((x) => other.place(x));
      const slope = 0.9 * largest / (high - low || 1);
      gl.uniform2f(places.sizes, 0.1 * largest - slope * low, slope);
    } else if (radius.logarithmic) {
      gl.uniform2f(places.sizes, radius.origin[0] + Math.log(factor / this.unit), radius.step[0]);
    } else {
      gl.uniform2f(places.sizes, radius.origin[0] * factor / this.unit, radius.step[0] * factor / this.unit);
    }
    gl.uniform1i(places.sizesLogarithmic, !other && radius.logarithmic);
    gl.uniform1f(places.leastRadius, LEAST_PIXELS);
    gl.uniform1f(places.pixel, lens.pixel);
    gl.uniform1f(places.missing, colour?.missing ? colour.largest : -1);
    if (colour) {
      const [low, high] = options.range.map((x) => colour.place(x));
      gl.uniform2f(places.colours, options.discrete ? low - 0.5 : low, 1 / (high - low + (options.discrete ? 1 : 0) || 1e-9));
    }
    gl.uniform4f(places.plain, 0.42, 0.6, 0.78, colour ? 0 : 1);
    gl.uniform1ui(places.chosen, this.chosen + 1);
    gl.uniform1ui(places.beyond, 0);
    gl.uniform1f(places.opacity, 1);
    gl.uniform1i(places.turned, Boolean(orientation));
    this.bindMap(places, this.colourMap, this.particles.shapes);
    gl.bindVertexArray(this.particles.array);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, trajectory.particles);
  }

  bindMap(places, map, shapes) {
    const gl = this.gl;
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, shapes);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, map);
    gl.uniform1i(places.map, 0);
    gl.uniform1i(places.shapes, 1);
  }

  drawMagnets(lens, opacity) {
    const gl = this.gl, places = this.use("magnets", lens);
    gl.uniform3f(places.origin, 0, 0, 0);
    gl.uniform3f(places.step_, 1, 1, 1);
    gl.uniform2f(places.sizes, 0, 1);
    gl.uniform1i(places.sizesLogarithmic, false);
    gl.uniform1f(places.leastRadius, 0);
    gl.uniform1f(places.missing, -1);
    gl.uniform4f(places.plain, 0.62, 0.64, 0.68, 1);
    gl.uniform1ui(places.chosen, 0);
    gl.uniform1ui(places.beyond, 0x40000000);
    gl.uniform1f(places.opacity, opacity);
    gl.uniform1i(places.turned, true);
    this.bindMap(places, this.colourMap, this.magnets.shapes);
    gl.bindVertexArray(this.magnets.array);
    gl.vertexAttrib1f(6, 1);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, this.scene.magnets.length);
  }

  pose(body) {
    const around = body ? this.around().bodies[body.k] : null, own = this.part.frame;
    if (!around?.poses?.length) return Matrix.pose([0, 0, 0, 0, 0, 0, 1]);
    const [a, b, c, ...q] = around.poses.slice(7 * own, 7 * own + 7), turn = Matrix.pose([0, 0, 0, ...q]);
    (around.stretches ?? []).slice(3 * own, 3 * own + 3).forEach((longer, k) => {
      for (let m = 0; m < 3; m++) turn[4 * k + m] *= longer;
    });
    // From relative coordinates to relative coordinates: R (centre + unit x) + shift.
    const moved = [0, 1, 2].map((m) => turn[m] * this.centre[0] + turn[4 + m] * this.centre[1] + turn[8 + m] * this.centre[2]);
    [a, b, c].forEach((x, m) => { turn[12 + m] = (moved[m] + x - this.centre[m]) / this.unit; });
    return turn;
  }

  drawLines(lens, samples) {
    const { gl, options } = this, places = this.use("lines", lens), ink = options.dark ? 0.62 : 0.42;
    const draw = (lines, body, rgba, width, weak = rgba, pull = rgba) => {
      if (!lines.count) return;
      gl.uniformMatrix4fv(places.pose, false, this.pose(body));
      gl.uniform4f(places.weak, ...weak);
      gl.uniform4f(places.plain, ...rgba);
      gl.uniform4f(places.pull, ...pull);
      gl.uniform2f(places.width, ...width.map((x) => x * samples * devicePixelRatio));
      gl.bindVertexArray(lines.array);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, lines.count);
    };
    gl.uniform2f(places.screen, this.canvas.width * samples, this.canvas.height * samples);
    if (options.box) draw(this.boxLines, null, [ink, ink, ink, 1], [0.9, 0]);
    if (options.walls) for (const body of this.bodies) draw(body.lines, body, [ink, ink * 1.02, ink * 1.06, 1], [1.1, 0]);
    if (options.lines && this.scene.lines) draw(this.fieldLines, null, [...this.scene.lines.colour.map((x) => x / 255 + (options.dark ? 0.2 : 0)), 1], [1.4, 0]);
    const { weak, strong, pull } = this.forceColours();
    if (options.contacts) draw(this.contactLines, null, [...strong, 1], [0.6, 6], [...weak, 1], [...pull, 1]);
  }

  drawWalls(lens) {
    const { gl, options } = this, places = this.use("walls", lens);
    for (const body of this.bodies) {
      gl.uniformMatrix4fv(places.pose, false, this.pose(body));
      gl.uniform4f(places.plain, ...(options.dark ? [0.62, 0.72, 0.84, 0.08] : [0.42, 0.52, 0.64, 0.09]));
      gl.bindVertexArray(body.array);
      gl.drawArrays(gl.TRIANGLES, 0, body.count);
    }
  }

  finish(lens, samples, image) {
    const { gl, canvas, options } = this, { program, places } = this.programs.screen;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.disable(gl.DEPTH_TEST);
    gl.useProgram(program);
    [image.textures[0], image.textures[2]].forEach((texture, k) => {
      gl.activeTexture(gl.TEXTURE0 + k);
      gl.bindTexture(gl.TEXTURE_2D, texture);
    });
    gl.uniform1i(places.image, 0);
    gl.uniform1i(places.depth, 1);
    const radius = this.scene.medianRadius / this.unit * options.scale, p = lens.projection;
    const onScreen = radius / lens.pixel / (options.flat ? 1 : lens.away);
    gl.uniform4f(places.lens, p[10], p[14], options.flat, Math.max(radius, 2 * radius / Math.max(onScreen, 0.5)));
    gl.uniform3fv(places.low, options.dark ? [0.055, 0.065, 0.085] : [0.93, 0.945, 0.96]);
    gl.uniform3fv(places.high, options.dark ? [0.105, 0.12, 0.15] : [1, 1, 1]);
    gl.uniform1f(places.strength, options.outlines ? 0.5 * Math.min(1, onScreen / 4) : 0);
    gl.uniform1f(places.wide, Math.min(Math.max(0.5 * onScreen, 2), 12));
    gl.uniform1i(places.samples, samples);
    gl.bindVertexArray(this.square.array);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  /** The row of the particle at a pixel of the canvas; -1 if there is none. */
  pick(x, y) {
    const { gl, image } = this, pixel = new Uint32Array(1);
    if (!image) return -1;
    const samples = image.width / this.canvas.width;
    gl.bindFramebuffer(gl.FRAMEBUFFER, image.buffer);
    gl.readBuffer(gl.COLOR_ATTACHMENT1);
    gl.readPixels(Math.floor(x * samples), Math.floor((this.canvas.height - 1 - y) * samples), 1, 1,
      gl.RED_INTEGER, gl.UNSIGNED_INT, pixel);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return pixel[0] > 0 && pixel[0] < 0x40000000 ? pixel[0] - 1 : -1;
  }

  // Moving the camera

  orbit(right, up) {
    this.camera.azimuth -= right;
    this.camera.elevation = Math.max(-1.5707, Math.min(1.5707, this.camera.elevation + up));
    this.touch();
  }

  /** Moves the target by lengths of the view's height. */
  pan(right, up) {
    const axes = this.axes(), size = 2 * this.camera.distance * Math.tan(FIELD_OF_VIEW / 2);
    this.camera.target = this.camera.target.map((x, k) => x - size * (right * axes.right[k] + up * axes.up[k]));
    this.touch();
  }

  zoom(factor) {
    this.camera.distance = Math.max(1e-3, Math.min(60 * this.reachable, this.camera.distance * factor));
    this.touch();
  }

  look(azimuth, elevation) {
    Object.assign(this.camera, { azimuth, elevation });
    this.touch();
  }

  /** The length in m of a pixel of the canvas at the target. */
  metresPerPixel() {
    const lens = this.lens();
    return lens.pixel * (this.options.flat ? 1 : this.camera.distance) * this.unit;
  }

  resize() {
    const ratio = devicePixelRatio, { clientWidth, clientHeight } = this.canvas;
    const width = Math.round(clientWidth * ratio), height = Math.round(clientHeight * ratio);
    if (width && height && (width !== this.canvas.width || height !== this.canvas.height)) {
      Object.assign(this.canvas, { width, height });
    }
    this.invalidate();
  }
}
