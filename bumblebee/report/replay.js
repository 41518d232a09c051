(async () => {
  const holder = document.querySelector("pre.replays"), figures = [...document.querySelectorAll("figure.replay")];
  if (!holder || !figures.length || !window.DecompressionStream) return;
  const bytes = (text) => Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0));
  const stream = new Blob([bytes(holder.textContent.trim())]).stream().pipeThrough(new DecompressionStream("deflate"));
  const {shapes, takes} = await new Response(stream).json();

  const turn = (q, v) => {  // a vector turned by a quaternion
    const [w, x, y, z] = q, [a, b, c] = v, s = -x * a - y * b - z * c;
    const [i, j, k] = [w * a + y * c - z * b, w * b + z * a - x * c, w * c + x * b - y * a];
    return [i * w - s * x - j * z + k * y, j * w - s * y - k * x + i * z, k * w - s * z - i * y + j * x];
  };
  const times = (p, q) => [
    p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3], p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
    p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1], p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0]];
  const plus = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]], minus = (a, b) => plus(a, b.map((x) => -x));
  const unit = (v) => { const n = Math.hypot(...v) || 1; return v.map((x) => x / n); };

  // MuJoCo's forward kinematics: place and quaternion of every body. Joints: free 0, ball 1, slide 2, hinge 3.
  const poses = (shape, q) => {
    const places = [[0, 0, 0]], quats = [[1, 0, 0, 0]];
    shape.bodies.forEach(([parent, ...own], body) => {
      if (!body) return;
      let place = plus(places[parent], turn(quats[parent], own.slice(0, 3))), quat = times(quats[parent], own.slice(3));
      for (const [, type, at, ax, ay, az, px, py, pz, zero] of shape.of[body]) {
        const axis = [ax, ay, az], arm = [px, py, pz];
        if (type === 0) { place = q.slice(at, at + 3); quat = unit(q.slice(at + 3, at + 7)); continue; }
        if (type === 2) { place = plus(place, turn(quat, axis.map((x) => x * (q[at] - zero)))); continue; }
        const anchor = plus(place, turn(quat, arm)), half = (q[at] - zero) / 2;
        const by = type === 1 ? unit(q.slice(at, at + 4)) : [Math.cos(half), ...axis.map((x) => x * Math.sin(half))];
        quat = times(quat, by);
        place = minus(anchor, turn(quat, arm));
      }
      places.push(place);
      quats.push(quat);
    });
    return [places, quats];
  };

  for (const shape of shapes) {
    shape.of = shape.bodies.map((_, body) => shape.joints.filter((joint) => joint[0] === body));
    const points = new Int16Array(bytes(shape.points).buffer), faces = new Uint32Array(bytes(shape.faces).buffer);
    shape.meshes = new Map();
    let point = 0, face = 0;
    for (const [body, many, triangles, ...rgb] of shape.pieces) {
      const made = smooth(points.subarray(3 * point, 3 * (point + many)), faces.subarray(3 * face, 3 * (face + triangles)), shape.scale, rgb);
      shape.meshes.set(body, [...(shape.meshes.get(body) || []), made]);
      point += many;
      face += triangles;
    }
  }
  // Corners with place, normal and colour; normals of faces that meet under less than 40 degrees are shared.
  function smooth(points, faces, scale, rgb) {
    const around = Array.from({length: points.length / 3}, () => []), normals = [];
    for (let f = 0; f < faces.length / 3; f++) {
      const [a, b, c] = [0, 1, 2].map((k) => [...points.subarray(3 * faces[3 * f + k], 3 * faces[3 * f + k] + 3)]);
      const [u, v] = [minus(b, a), minus(c, a)];
      normals.push(unit([u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]));
      for (let k = 0; k < 3; k++) around[faces[3 * f + k]].push(f);
    }
    const made = new Float32Array(faces.length * 9);
    faces.forEach((point, corner) => {
      const own = normals[Math.floor(corner / 3)];
      const near = around[point].map((f) => normals[f]).filter((n) => n[0] * own[0] + n[1] * own[1] + n[2] * own[2] > 0.76);
      made.set([...points.subarray(3 * point, 3 * point + 3)].map((x) => x * scale), 9 * corner);
      made.set(unit(near.reduce(plus, [0, 0, 0])), 9 * corner + 3);
      made.set(rgb, 9 * corner + 6);
    });
    return made;
  }

  const unpack = (take) => {
    if (take.columns) return;
    const changes = new Uint16Array(bytes(take.states).buffer);
    let at = 0;
    take.columns = take.low.map((low, i) => {
      const column = new Float32Array(take.frames).fill(low);
      for (let f = 0, sum = 0; take.step[i] > 0 && f < take.frames; f++) {
        sum = (sum + changes[at++]) & 65535;
        column[f] += sum * take.step[i];
      }
      return column;
    });
  };

  const VERTEX = `#version 300 es
    layout(location=0) in vec3 place; layout(location=1) in vec3 normal; layout(location=2) in vec3 rgb;
    uniform mat4 view; uniform mat4 pose; out vec3 n, c, w;
    void main() { vec4 at = pose * vec4(place, 1.); n = mat3(pose) * normal; c = rgb; w = at.xyz; gl_Position = view * at; }`;
  const FRAGMENT = `#version 300 es
    precision highp float; in vec3 n, c, w; uniform vec4 tint; uniform vec3 eye; uniform vec4 ground; uniform float size;
    out vec4 colour;
    void main() {
      if (ground.a > 0.) {
        vec2 cell = floor(w.xy / size); float odd = mod(cell.x + cell.y, 2.);
        float fade = 1. - smoothstep(4. * size, 12. * size, distance(w.xy, ground.xy));
        colour = vec4(ground.zzz, (odd > .5 ? .16 : .07) * fade); return;
      }
      vec3 to = normalize(eye - w), m = normalize(n); m = dot(m, to) < 0. ? -m : m;
      float light = .42 + .4 * max(dot(m, normalize(vec3(.4, -.5, .9))), 0.) + .25 * max(dot(m, to), 0.);
      vec3 base = tint.a > 0. ? tint.rgb : c;
      colour = vec4(base * light + .12 * pow(max(dot(m, normalize(to + vec3(.4, -.5, .9))), 0.), 24.), tint.a > 0. ? tint.a : 1.);
    }`;
  const start = (gl) => {
    const program = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return null;
    gl.useProgram(program);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    return (name) => gl.getUniformLocation(program, name);
  };
  const matrix = (place, q) => [...turn(q, [1, 0, 0]), 0, ...turn(q, [0, 1, 0]), 0, ...turn(q, [0, 0, 1]), 0, ...place, 1];
  const mesh = (gl, corners) => {
    const made = gl.createVertexArray(), buffer = gl.createBuffer();
    gl.bindVertexArray(made);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, corners, gl.STATIC_DRAW);
    for (const i of [0, 1, 2]) {
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, 3, gl.FLOAT, false, 36, 12 * i);
    }
    return [made, corners.length / 9, buffer];
  };

  const player = (figure) => {
    const mine = takes.filter((take) => take.group === figure.dataset.group);
    const canvas = figure.querySelector("canvas"), gl = mine.length && canvas.getContext("webgl2", {antialias: true});
    const uniform = gl && start(gl);
    if (!uniform) return;
    const find = (name) => figure.querySelector(name);
    const [play, slider, clock, speed, menu, follow] = [".play", "input[type=range]", "output", ".speed", ".takes", ".follow"].map(find);
    const still = matchMedia("(prefers-reduced-motion: reduce)"), dark = matchMedia("(prefers-color-scheme: dark)");
    const drawn = new Map();
    let take, at = 0, playing = false, seen = false, before = 0, centre, radius, yaw = -0.8, pitch = 0.22, near = 1;

    const state = (robot) => {
      const nq = take.shape_.nq, last = take.frames - 1, low = Math.min(Math.floor(at), last), share = at - low;
      return take.columns.slice(robot * nq, (robot + 1) * nq).map((c) => c[low] + share * (c[Math.min(low + 1, last)] - c[low]));
    };
    const draw = () => {
      const ratio = Math.min(devicePixelRatio || 1, 2), [wide, high] = [canvas.clientWidth * ratio, canvas.clientHeight * ratio].map(Math.round);
      if (!wide || !high) return;
      if (canvas.width !== wide || canvas.height !== high) [canvas.width, canvas.height] = [wide, high];
      gl.viewport(0, 0, wide, high);
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      const shown = take.robots.map((_, robot) => poses(take.shape_, state(robot)));
      const base = shown[0][0][1], aim = take.shape_.free && follow.checked ? [base[0], base[1], centre[2]] : centre;
      const away = radius * 2.9 * near * Math.max(1, 1.1 * high / wide), flat = Math.cos(pitch);
      const eye = plus(aim, [away * flat * Math.cos(yaw), away * flat * Math.sin(yaw), away * Math.sin(pitch)]);
      const back = unit(minus(eye, aim)), right = unit([-back[1], back[0], 0]);
      const up = [back[1] * right[2] - back[2] * right[1], back[2] * right[0] - back[0] * right[2], back[0] * right[1] - back[1] * right[0]];
      const f = 2.4, [first, far] = [away / 50, away * 12], dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
      const row = [right.map((x) => x * f * high / wide), up.map((x) => x * f), back];
      const z = [(far + first) / (first - far), 2 * far * first / (first - far)], moved = row.map((r) => -dot(r, eye));
      const view = [];
      for (let i = 0; i < 3; i++) view.push(row[0][i], row[1][i], z[0] * back[i], -back[i]);
      view.push(moved[0], moved[1], z[0] * moved[2] + z[1], -moved[2]);
      gl.uniformMatrix4fv(uniform("view"), false, view);
      gl.uniform3fv(uniform("eye"), eye);
      gl.uniform4f(uniform("ground"), 0, 0, 0, 0);
      const robot = ([places, quats]) => {
        for (const [body, parts] of drawn.get(take.shape_)) {
          gl.uniformMatrix4fv(uniform("pose"), false, matrix(places[body], quats[body]));
          for (const [vertices, count] of parts) {
            gl.bindVertexArray(vertices);
            gl.drawArrays(gl.TRIANGLES, 0, count);
          }
        }
      };
      const order = take.robots.map(([, tint], i) => [tint, shown[i]]);
      for (const [, pose] of order.filter(([tint]) => !tint)) {
        gl.uniform4f(uniform("tint"), 0, 0, 0, 0);
        robot(pose);
      }
      gl.enable(gl.BLEND);
      if (take.shape_.floor) {
        gl.uniform4f(uniform("ground"), base[0], base[1], dark.matches ? 1 : 0.1, 1);
        gl.uniform1f(uniform("size"), radius / 2);
        gl.uniformMatrix4fv(uniform("pose"), false, matrix([0, 0, 0], [1, 0, 0, 0]));
        const [x, y, r] = [base[0], base[1], 7 * radius], quad = [[-r, -r], [r, -r], [r, r], [-r, -r], [r, r], [-r, r]];
        gl.bindVertexArray(floor[0]);
        gl.bindBuffer(gl.ARRAY_BUFFER, floor[2]);
        gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(quad.flatMap(([a, b]) => [x + a, y + b, 0, 0, 0, 1, 0, 0, 0])), gl.DYNAMIC_DRAW);
        gl.depthMask(false);
        gl.drawArrays(gl.TRIANGLES, 0, 6);
        gl.depthMask(true);
        gl.uniform4f(uniform("ground"), 0, 0, 0, 0);
      }
      for (const [tint, pose] of order.filter(([tint]) => tint)) {  // first the depth, so that no inner side shines through
        gl.uniform4fv(uniform("tint"), tint);
        gl.colorMask(false, false, false, false);
        robot(pose);
        gl.colorMask(true, true, true, true);
        robot(pose);
      }
      gl.disable(gl.BLEND);
    };
    const show = (frame) => {
      at = frame;
      const seconds = (count) => (count / take.fps).toFixed(2);
      slider.value = Math.round(at);
      clock.textContent = `${seconds(at)} of ${seconds(take.frames - 1)} s`;
      slider.setAttribute("aria-valuetext", clock.textContent);
      draw();
    };
    const run = (now) => {
      if (!playing || !seen) return void (before = 0);
      const next = at + (before ? (now - before) / 1000 : 0) * take.fps * +speed.value;
      before = now;
      if (next > take.frames - 1 && still.matches) set(false);
      show(next > take.frames - 1 ? (still.matches ? take.frames - 1 : 0) : next);
      requestAnimationFrame(run);
    };
    const set = (wanted) => {
      const begin = wanted && !(playing && seen);
      playing = wanted;
      if (wanted && at >= take.frames - 1) at = 0;
      play.textContent = playing ? "Pause" : "Play";
      figure.dataset.state = playing ? "playing" : "paused";
      if (begin) requestAnimationFrame(run);
    };
    const choose = (one) => {
      take = one;
      take.shape_ = shapes[take.shape];
      unpack(take);
      if (!drawn.has(take.shape_)) drawn.set(take.shape_, [...take.shape_.meshes].map(([body, parts]) => [body, parts.map((p) => mesh(gl, p))]));
      at = 0;
      const [places, quats] = poses(take.shape_, state(0)), [low, high] = [[1e9, 1e9, 1e9], [-1e9, -1e9, -1e9]];
      for (const [body, parts] of take.shape_.meshes)
        for (const corners of parts)
          for (let i = 0; i < corners.length; i += 9) {
            const point = plus(places[body], turn(quats[body], [...corners.subarray(i, i + 3)]));
            for (let k = 0; k < 3; k++) [low[k], high[k]] = [Math.min(low[k], point[k]), Math.max(high[k], point[k])];
          }
      centre = low.map((x, k) => (x + high[k]) / 2);
      radius = Math.hypot(...minus(high, low)) / 2 || 1;
      slider.max = take.frames - 1;
      menu.value = takes.indexOf(take);
      find(".about-take").textContent = take.note;
      find(".robots").replaceChildren(...(take.robots.length > 1 ? take.robots : []).map(([name, tint]) => {
        const entry = document.createElement("span");
        entry.textContent = name;
        entry.style.setProperty("--shade", tint ? `rgb(${tint.slice(0, 3).map((x) => 255 * x)})` : "#8d939b");
        return entry;
      }));
      find(".follows").hidden = !take.shape_.free;
      show(0);
    };

    const floor = mesh(gl, new Float32Array(54));
    for (const one of mine) {
      const entry = document.createElement("option");
      [entry.value, entry.textContent] = [takes.indexOf(one), one.name];
      menu.append(entry);
    }
    menu.parentElement.hidden = mine.length < 2;
    play.addEventListener("click", () => set(!playing));
    slider.addEventListener("input", () => { set(false); show(+slider.value); });
    menu.addEventListener("change", () => choose(takes[menu.value]));
    follow.addEventListener("change", draw);
    addEventListener("beforeprint", () => set(false));
    let held = null;
    canvas.addEventListener("pointerdown", (event) => { held = [event.clientX, event.clientY]; canvas.setPointerCapture(event.pointerId); });
    canvas.addEventListener("pointerup", () => { held = null; });
    canvas.addEventListener("pointermove", (event) => {
      if (!held) return;
      yaw -= (event.clientX - held[0]) / 120;
      pitch = Math.min(1.5, Math.max(-0.2, pitch + (event.clientY - held[1]) / 160));
      held = [event.clientX, event.clientY];
      draw();
    });
    canvas.addEventListener("wheel", (event) => {
      if (document.activeElement !== canvas) return;  // a page that is scrolled past stays scrollable
      event.preventDefault();
      near = Math.min(4, Math.max(0.3, near * Math.exp(event.deltaY / 800)));
      draw();
    }, {passive: false});
    canvas.addEventListener("keydown", (event) => {
      const way = {ArrowLeft: [0.15, 0], ArrowRight: [-0.15, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1]}[event.key];
      if (!way) return;
      event.preventDefault();
      [yaw, pitch] = [yaw + way[0], Math.min(1.5, Math.max(-0.2, pitch + way[1]))];
      draw();
    });
    if (figure.closest("figure.map")) document.addEventListener("chosen", (event) => {  // a motion of the map
      const one = mine.find((wanted) => wanted.name === event.detail.name);
      figure.hidden = !one;
      if (!one) return;
      event.detail.shown = true;
      if (one !== take) choose(one);
    });
    dark.addEventListener("change", draw);
    find(".live").hidden = false;
    find(".still").hidden = true;
    choose(mine[0]);
    set(!still.matches);
    new ResizeObserver(draw).observe(canvas);
    new IntersectionObserver(([entry]) => {
      const came = entry.isIntersecting && !seen;
      seen = entry.isIntersecting;
      if (came && playing) { before = 0; requestAnimationFrame(run); }
    }).observe(canvas);
    figure.dataset.drawn = "3d";
  };
  figures.forEach(player);
  document.dispatchEvent(new Event("replays"));
})();
