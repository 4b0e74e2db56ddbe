// Plays the 3D scene of a report: WebGL 2, no library. Its data is the JSON in the element "scene-data" (played.py).
"use strict";
(() => {
  const $ = id => document.getElementById(id);
  const D = JSON.parse($("scene-data").textContent), canvas = $("scene"), gl = canvas.getContext("webgl2", {antialias: true});
  if (!gl) { $("scene-box").classList.add("none"); return; }

  // ---- numbers
  const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer;
  const mul = (a, b) => a.map((_, i) => {
    const c = i >> 2, r = i & 3;
    return a[r] * b[4 * c] + a[r + 4] * b[4 * c + 1] + a[r + 8] * b[4 * c + 2] + a[r + 12] * b[4 * c + 3];
  });
  const ONE = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
  const shift = (x, y, z) => [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1];
  const turn = ([x, y, z], angle) => {
    const c = Math.cos(angle), s = Math.sin(angle), k = 1 - c;
    return [k * x * x + c, k * x * y + s * z, k * x * z - s * y, 0, k * x * y - s * z, k * y * y + c, k * y * z + s * x, 0,
      k * x * z + s * y, k * y * z - s * x, k * z * z + c, 0, 0, 0, 0, 1];
  };
  const sub = (a, b) => a.map((v, i) => v - b[i]), dot = (a, b) => a.reduce((s, v, i) => s + v * b[i], 0);
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = a => { const n = Math.hypot(...a) || 1; return a.map(v => v / n); };
  const apply = (m, p) => [0, 1, 2, 3].map(r => m[r] * p[0] + m[r + 4] * p[1] + m[r + 8] * p[2] + m[r + 12]);

  // ---- one program: lit triangles, and plain lines and points
  const shader = (kind, text) => { const s = gl.createShader(kind); gl.shaderSource(s, text); gl.compileShader(s); return s; };
  const program = gl.createProgram();
  gl.attachShader(program, shader(gl.VERTEX_SHADER, `#version 300 es
    layout(location=0) in vec3 p; layout(location=1) in vec3 n; uniform mat4 view, model; uniform float size;
    out vec3 at, normal;
    void main() { vec4 w = model * vec4(p, 1.); at = w.xyz; normal = mat3(model) * n; gl_Position = view * w; gl_PointSize = size; }`));
  gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `#version 300 es
    precision highp float; in vec3 at, normal; uniform vec4 colour; uniform vec3 eye; uniform float lit; out vec4 o;
    void main() {
      if (lit < .5) { o = vec4(colour.rgb * colour.a, colour.a); return; }
      vec3 n = normalize(dot(normal, normal) > 0. ? normal : cross(dFdx(at), dFdy(at))), v = normalize(eye - at);
      if (dot(n, v) < 0.) n = -n;
      float sun = max(dot(n, normalize(vec3(.5, -.45, .85))), 0.), sky = .5 + .5 * n.z, rim = pow(1. - max(dot(n, v), 0.), 3.);
      vec3 c = colour.rgb * (.46 + .22 * sky + .42 * sun) + .10 * rim;
      o = vec4(min(c, 1.) * colour.a, colour.a);
    }`));
  gl.linkProgram(program); gl.useProgram(program);
  const U = Object.fromEntries(["view", "model", "colour", "eye", "lit", "size"].map(n => [n, gl.getUniformLocation(program, n)]));
  const buffer = (kind, data) => { const b = gl.createBuffer(); gl.bindBuffer(kind, b); gl.bufferData(kind, data, gl.STATIC_DRAW); return b; };
  const shape = (points, faces, smooth, mode) => {  // a vertex array to draw
    const vao = gl.createVertexArray(); gl.bindVertexArray(vao);
    buffer(gl.ARRAY_BUFFER, points); gl.enableVertexAttribArray(0); gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    if (smooth) {
      const normals = new Float32Array(points.length), corner = i => points.slice(3 * i, 3 * i + 3);
      for (let i = 0; i < faces.length; i += 3) {
        const [a, b, c] = [corner(faces[i]), corner(faces[i + 1]), corner(faces[i + 2])];
        const n = cross([...sub(b, a)], [...sub(c, a)]);
        for (let k = 0; k < 3; k++) for (let j = 0; j < 3; j++) normals[3 * faces[i + k] + j] += n[j];
      }
      buffer(gl.ARRAY_BUFFER, normals); gl.enableVertexAttribArray(1); gl.vertexAttribPointer(1, 3, gl.FLOAT, false, 0, 0);
    }
    if (faces) buffer(gl.ELEMENT_ARRAY_BUFFER, faces);
    return {vao, indexed: !!faces, count: faces ? faces.length : points.length / 3, mode: mode ?? gl.TRIANGLES};
  };
  const scaled = text => Float32Array.from(new Int16Array(bytes(text)), v => v * D.step);
  const solid = s => shape(scaled(s.v), new Uint16Array(bytes(s.f)), s.smooth);
  const rgb = (c, a = 1) => [c[0] / 255, c[1] / 255, c[2] / 255, a];

  // ---- what there is to draw
  const solids = D.solids.map(s => ({...solid(s), frame: s.frame, colour: rgb(s.colour, s.opacity)}));
  const walls = D.outlines.map(o => {
    const n = o.at.length, wall = [], ring = [], line = [], quads = [];
    o.at.forEach(([x, y], i) => {
      const [a, b] = o.across[i];
      wall.push(x, y, 0, x, y, o.height); line.push(x, y, o.height);
      ring.push(x - a, y - b, o.height, x + a, y + b, o.height);
      if (i < n - 1) quads.push(2 * i, 2 * i + 2, 2 * i + 3, 2 * i, 2 * i + 3, 2 * i + 1);
    });
    const f = new Uint16Array(quads), middle = [0, 1].map(k => o.at.reduce((s, p) => s + p[k], 0) / n);
    return {i: o.i, wall: shape(new Float32Array(wall), f), ring: shape(new Float32Array(ring), f),
      line: shape(new Float32Array(line), null, 0, gl.LINE_STRIP), label: [...middle, o.height + .012]};
  });
  const lines = points => shape(new Float32Array(points), null, 0, gl.LINES);
  const dots = shape(new Float32Array(D.touches.flatMap(t => t.slice(1, 4))), null, 0, gl.POINTS);
  const reactions = lines(D.touches.flatMap(t => [...t.slice(1, 4), ...[1, 2, 3].map(i => t[i] + D.sizes[1] * t[i + 3])]));
  const felt = D.felt.map(p => shape(scaled(p), null, 0, gl.POINTS));
  const rim = D.rim.length ? shape(new Float32Array(D.rim.flat()), null, 0, gl.LINE_STRIP) : null;
  const ghosts = D.ghosts.map(g => ({...solid(g.solid), name: g.name, at: g.at}));
  D.keys.forEach((k, i) => {
    const before = i ? D.keys[i - 1].fit : null;
    if (k.fit && k.fit.solid) k.fit.shape = before && before.solid && before.solid.v === k.fit.solid.v ? before.shape : solid(k.fit.solid);
  });
  const pad = shape(new Float32Array([-.011, -.004, -.055, .011, -.004, -.055, .011, .004, -.055, -.011, .004, -.055,
    -.011, -.004, .015, .011, -.004, .015, .011, .004, .015, -.011, .004, .015]),
    new Uint16Array([0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4, 1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7]));

  // ---- motion
  const M = D.motion, dof = D.robot.joints.length, q = new Int16Array(bytes(M.q)), jaw = new Uint16Array(bytes(M.jaw));
  const force = new Uint16Array(bytes(M.force)), frames = jaw.length, end = D.start + (frames - 1) / D.rate;
  const between = (a, i, k, n) => { const j = Math.min(i + 1, frames - 1); return a[i * n] + (a[j * n] - a[i * n]) * k; };
  const until = (list, t) => { let a = 0, b = list.length; while (a < b) { const m = (a + b) >> 1; (list[m][0] <= t + 1e-6 ? (a = m + 1) : (b = m)); } return a; };
  const keyed = D.keys.map(k => [k.t, k]), touched = D.touches, skills = D.skills;
  const key = t => D.keys[Math.max(until(keyed, t) - 1, 0)];
  const framesAt = (t, k) => {
    const x = Math.min(Math.max((t - D.start) * D.rate, 0), frames - 1), i = Math.floor(x), part = x - i;
    const F = {base: ONE, K: D.K, stand: D.stand || ONE};
    let at = ONE;
    D.robot.joints.forEach((joint, j) => {
      at = mul(mul(at, joint.at), turn(joint.axis, between(q.subarray(j), i, part, dof) * M.steps[0]));
      F[String(j + 1)] = at;
    });
    F.hand = mul(at, D.robot.E); F.P = mul(F.hand, D.robot.P);
    const half = .5 * between(jaw, i, part, 1) * M.steps[1];
    F.left = mul(F.P, shift(0, half, 0)); F.right = mul(F.P, shift(0, -half, 0));
    if (!k.lost && k.tip !== null) F.probe = mul(F.P, shift(0, 0, k.tip - D.probe));
    else if (!k.lost && D.stand) F.probe = D.stand;
    return F;
  };

  // ---- the camera turns about a point
  const K = D.K.slice(12, 15), outward = Math.atan2(K[1], K[0]);
  const cam = {yaw: outward - .72, pitch: .6, far: 1.02, at: [K[0] * .93, K[1] * .93, K[2] + .13]};
  const look = () => {
    const {yaw, pitch, far, at} = cam, c = Math.cos(pitch);
    const eye = [at[0] + far * c * Math.cos(yaw), at[1] + far * c * Math.sin(yaw), at[2] + far * Math.sin(pitch)];
    const z = unit(sub(eye, at)), x = unit(cross([0, 0, 1], z)), y = cross(z, x), f = 1 / Math.tan(.36);
    const seen = [x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, -dot(x, eye), -dot(y, eye), -dot(z, eye), 1];
    const wide = canvas.width / canvas.height, zoom = wide < 1.3 ? f * wide / 1.3 : f, near = .03, far_m = 12;
    const lens = [zoom / wide, 0, 0, 0, 0, zoom, 0, 0, 0, 0, (far_m + near) / (near - far_m), -1, 0, 0, 2 * far_m * near / (near - far_m), 0];
    return {eye, view: mul(lens, seen), x, y};
  };

  // ---- drawing
  const draw = (s, model, colour, lit = 1, size = 1, count = s.count) => {
    gl.bindVertexArray(s.vao);
    gl.uniformMatrix4fv(U.model, false, model); gl.uniform4fv(U.colour, colour); gl.uniform1f(U.lit, lit); gl.uniform1f(U.size, size);
    if (s.indexed) gl.drawElements(s.mode, count, gl.UNSIGNED_SHORT, 0); else gl.drawArrays(s.mode, 0, count);
  };
  const shown = name => { const box = $("show-" + name); return !box || box.checked; };
  const state = {t: end, playing: false, dirty: true};
  const paint = () => {
    const ratio = Math.min(devicePixelRatio || 1, 2), w = Math.round(canvas.clientWidth * ratio), h = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    const {eye, view} = look(), k = key(state.t), F = framesAt(state.t, k), c = D.colours;
    gl.viewport(0, 0, w, h); gl.clearColor(0, 0, 0, 0); gl.depthMask(true); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST); gl.enable(gl.BLEND); gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.uniformMatrix4fv(U.view, false, view); gl.uniform3fv(U.eye, eye);
    for (const s of solids) if (s.colour[3] === 1 && F[s.frame]) draw(s, F[s.frame], s.colour);
    if (rim) draw(rim, D.K, [.42, .36, .27, 1], 0);
    if (k.fit && k.fit.shape && shown("candidates")) draw(k.fit.shape, D.K, rgb(c.fit));
    const n = until(touched, state.t);
    if (shown("contacts") && n) {
      const px = D.sizes[0] * 2 / cam.far * h * .8;
      draw(dots, D.K, rgb(c.touch), 0, Math.max(px, 4 * ratio), n); draw(reactions, D.K, rgb(c.touch), 0, 1, 2 * n);
      for (const p of felt.slice(0, k.felt)) draw(p, D.K, [.95, .55, .1, 1], 0, 2 * ratio);
    }
    gl.depthMask(false);
    const present = k.outlines.map(i => walls[i]);
    if (shown("candidates")) for (const o of present) {
      const word = k.states[o.i] || "found", colour = c[word], faded = word === "excluded" || word === "taken";
      draw(o.wall, D.K, rgb(colour, faded ? .14 : .28), 0); draw(o.ring, D.K, rgb(colour, faded ? .45 : .8), 0); draw(o.line, D.K, rgb(colour), 0);
    }
    if (k.grasp) for (const side of [1, -1]) draw(pad, mul(D.K, mul(k.grasp.at, shift(0, side * (.5 * k.grasp.opening + .004), 0))), rgb(c.plan, .5));
    const when = $("show-truth") ? Number($("show-truth").value) : -1;
    if (when >= 0) for (const g of ghosts) draw(g, g.at[when], rgb(c.ghost, .4));
    for (const s of solids) if (s.colour[3] < 1 && F[s.frame]) draw(s, F[s.frame], s.colour);
    label(shown("candidates") ? present : [], k, view);
  };
  const names = $("scene-names");
  const label = (present, k, view) => {
    names.replaceChildren(...present.map(o => {
      const p = apply(view, apply(D.K, o.label)), share = k.shares[o.i], text = document.createElement("span");
      text.textContent = o.i + (share === undefined ? "" : ` · ${(100 * share).toFixed(0)} %`);
      text.style.left = `${50 + 50 * p[0] / p[3]}%`; text.style.top = `${50 - 50 * p[1] / p[3]}%`;
      return text;
    }));
  };
  const words = () => {
    const i = until(skills, state.t), f = force[Math.min(Math.round((state.t - D.start) * D.rate), frames - 1)] * M.steps[2];
    $("scene-time").textContent = `${state.t.toFixed(1)} s`;
    $("scene-skill").textContent = i ? skills[i - 1][1] : "";
    $("scene-force").textContent = `${f.toFixed(1)} N`;
    $("scene-slider").value = state.t;
  };

  // ---- controls
  const slider = $("scene-slider"), play = $("scene-play");
  slider.min = D.start; slider.max = end; slider.step = .05;
  const seek = t => { state.t = Math.min(Math.max(t, D.start), end); state.dirty = true; };
  const toggle = on => { state.playing = on; play.textContent = on ? "pause" : "play"; };
  slider.addEventListener("input", () => { toggle(false); seek(Number(slider.value)); });
  play.addEventListener("click", () => { if (!state.playing && state.t >= end - .05) seek(D.start); toggle(!state.playing); });
  for (const box of document.querySelectorAll("#scene-box [id^=show-]")) box.addEventListener("change", () => { state.dirty = true; });
  const pointers = new Map();
  canvas.addEventListener("pointerdown", e => { pointers.set(e.pointerId, [e.clientX, e.clientY]); canvas.setPointerCapture(e.pointerId); });
  for (const over of ["pointerup", "pointercancel"]) canvas.addEventListener(over, e => pointers.delete(e.pointerId));
  canvas.addEventListener("contextmenu", e => e.preventDefault());
  canvas.addEventListener("pointermove", e => {
    const before = pointers.get(e.pointerId);
    if (!before) return;
    const dx = e.clientX - before[0], dy = e.clientY - before[1];
    if (pointers.size > 1) {
      const other = [...pointers].find(([id]) => id !== e.pointerId)[1];
      cam.far *= Math.hypot(before[0] - other[0], before[1] - other[1]) / (Math.hypot(e.clientX - other[0], e.clientY - other[1]) || 1);
    } else if (e.buttons === 2 || e.shiftKey) {
      const {x, y} = look(), k = cam.far * .75 / canvas.clientHeight;
      cam.at = cam.at.map((v, i) => v - k * (dx * x[i] - dy * y[i]));
    } else { cam.yaw -= dx * .008; cam.pitch = Math.min(Math.max(cam.pitch + dy * .008, -.2), 1.55); }
    cam.far = Math.min(Math.max(cam.far, .15), 5);
    pointers.set(e.pointerId, [e.clientX, e.clientY]); state.dirty = true;
  });
  canvas.addEventListener("wheel", e => { e.preventDefault(); cam.far = Math.min(Math.max(cam.far * Math.exp(e.deltaY * .001), .15), 5); state.dirty = true; }, {passive: false});
  new ResizeObserver(() => { state.dirty = true; }).observe(canvas);
  const asked = Number(new URLSearchParams(location.hash.slice(1)).get("t"));
  seek(location.hash.includes("t=") ? asked : end);
  let last = 0;
  const step = now => {
    if (state.playing) { seek(state.t + (now - last) * .001 * Number($("scene-speed").value)); if (state.t >= end) toggle(false); }
    last = now;
    if (state.dirty) { state.dirty = false; paint(); words(); }
    requestAnimationFrame(step);
  };
  requestAnimationFrame(step);
})();
