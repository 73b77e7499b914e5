// Draws a machine in space as a camera sees it that turns, zooms and moves: the far before the near, faces shaded.
"use strict";

const add = (a, b, k = 1) => [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => add([0, 0, 0], a, 1 / (Math.hypot(...a) || 1));

function spatial(run, figure, redraw) {
  const canvas = figure.querySelector("canvas"), context = canvas.getContext("2d");
  const [right, up] = run.front, near = cross(right, up), low = run.box.slice(0, 3), high = run.box.slice(3);
  const extent = Math.max(...add(high, low, -1)) || 1;
  const radius = Math.hypot(...add(high, low, -1)) / 2 || 1, away = 6 * radius;
  const middle = add(add([0, 0, 0], add(low, high), 0.5), up, -0.03 * extent);
  const floor = Math.min(dot(low, up), dot(high, up)) - 0.06 * extent;
  const light = unit([-0.4, 0.75, 0.6]), [yaw, pitch] = run.views.corner;
  const home = { yaw, pitch, zoom: 1, x: 0, y: 0 }, pointers = new Map();
  let camera = { ...home }, eye, scale, centre, things;

  function look(width, height) {
    const aside = add(add([0, 0, 0], right, Math.cos(camera.yaw)), near, Math.sin(camera.yaw));
    const towards = add(add([0, 0, 0], cross(aside, up), Math.cos(camera.pitch)), up, Math.sin(camera.pitch));
    eye = [aside, cross(towards, aside), towards];
    scale = camera.zoom * Math.min(width, 1.15 * height) / (1.9 * radius);
    centre = [width / 2 + camera.x, height / 2 + camera.y];
  }

  // A place on the screen, with how near it is.
  function to(p) {
    const q = add(p, middle, -1), depth = dot(q, eye[2]), size = scale * away / (away - Math.min(depth, 0.9 * away));
    return [centre[0] + size * dot(q, eye[0]), centre[1] - size * dot(q, eye[1]), depth];
  }

  function trace(points) {
    context.beginPath();
    points.forEach((p, k) => (k ? context.lineTo(p[0], p[1]) : context.moveTo(p[0], p[1])));
  }

  function stroke(points, colour, thickness, dashes = []) {
    trace(points);
    context.setLineDash(dashes);
    context.strokeStyle = colour;
    context.lineWidth = thickness;
    context.stroke();
    context.setLineDash([]);
  }

  function later(points, paint, nearer = 0) {
    things.push({ depth: points.reduce((sum, p) => sum + p[2], 0) / points.length + nearer, paint });
  }

  function line(places, colour, thickness, dashes) {
    const points = places.map(to);
    later(points, () => stroke(points, colour, thickness, dashes));
  }

  function sprite(place, paint) {
    const p = to(place);
    later([p], () => paint(p), 0.06 * extent);
  }

  function dots(p, size, colour) {
    context.beginPath();
    context.arc(p[0], p[1], size, 0, 2 * Math.PI);
    context.fillStyle = colour;
    context.fill();
  }

  function face(corners, colour, clear) {
    const points = corners.map(to);
    let turn = 0;
    points.forEach((p, k) => { const q = points[(k + 1) % points.length]; turn += p[0] * q[1] - p[1] * q[0]; });
    if (turn >= 0 && !clear) return;  // seen from behind
    const normal = unit(cross(add(corners[1], corners[0], -1), add(corners[corners.length - 1], corners[0], -1)));
    const seen = eye.map((axis) => dot(axis, normal)), bright = 0.6 + 0.4 * Math.max(0, dot(seen, light));
    const shade = colour.map((part) => Math.round(part * bright + 60 * Math.max(0, bright - 0.85)));
    const paint = `rgb(${shade}${clear ? ", 0.2" : ""})`.replace("rgb(", clear ? "rgba(" : "rgb(");
    later(points, () => {
      trace(points);
      context.closePath();
      context.fillStyle = paint;
      context.fill();
      context.strokeStyle = clear ? "rgba(0, 70, 120, 0.55)" : paint;
      context.lineWidth = clear ? 1 : 0.8;
      context.stroke();
    });
  }

  // A bar as faces between rings of corners; without `side` its rotation about its axis is unknown.
  function bar(axis, side, size, clear, round, colour) {
    const least = 3.5 / scale, count = axis.length, parts = count === 2 && !clear ? 8 : 1, rings = [];
    const corners = clear || count === 2 ? 16 : 8;
    let across = side ? side[0] : Math.abs(dot(unit(add(axis[1], axis[0], -1)), up)) < 0.9 ? up : right;
    for (let k = 0; k < count; k += 1) {
      const along = unit(add(axis[Math.min(k + 1, count - 1)], axis[Math.max(k - 1, 0)], -1));
      if (side) across = side[Math.min(k, side.length - 1)];
      across = unit(add(across, along, -dot(across, along)));
      const third = cross(along, across), [height, width] = size[k].map((one) => Math.max(one, least) / 2);
      const ways = round ? [...Array(corners)].map((_, n) => [Math.cos((2 * n + 1) * Math.PI / corners),
        Math.sin((2 * n + 1) * Math.PI / corners)]) : [[1, 1], [-1, 1], [-1, -1], [1, -1]];
      rings.push(ways.map(([a, b]) => add(add(axis[k], across, a * height), third, b * width)));
    }
    const sides = rings[0].length;
    for (let k = 0; k + 1 < count; k += 1) {
      for (let part = 0; part < parts; part += 1) {
        const [from, until] = [part / parts, (part + 1) / parts].map((share) =>
          rings[k].map((corner, n) => add(add([0, 0, 0], corner, 1 - share), rings[k + 1][n], share)));
        for (let n = 0; n < sides; n += 1) {
          const m = (n + 1) % sides;
          // The face that the height points to is of another colour, so that a turn about the axis is seen.
          const plain = side && n === sides - 1 ? [86, 180, 233] : [0, 114, 178];
          face([from[n], from[m], until[m], until[n]], colour ? colour(k) : plain, clear);
        }
      }
    }
    face([...rings[0]].reverse(), [0, 114, 178], clear);
    face(rings[count - 1], [0, 114, 178], clear);
  }

  const down = (p) => add(p, up, floor - dot(p, up));

  function ground(width, height) {
    const cell = handy(0.4 * extent);
    const ranges = [right, near].map((way) => [low, high].map((corner) => dot(corner, way)).sort((a, b) => a - b))
      .map(([from, until]) => [Math.floor(from / cell - 0.3) * cell, Math.ceil(until / cell + 0.3) * cell]);
    const at = (a, b) => to(add(add(add([0, 0, 0], right, a), near, b), up, floor));
    const lines = (range) => [...Array(Math.round((range[1] - range[0]) / cell) + 1)].map((_, k) => range[0] + k * cell);
    for (const a of lines(ranges[0])) stroke([at(a, ranges[1][0]), at(a, ranges[1][1])], "#E2E2E2", 1);
    for (const b of lines(ranges[1])) stroke([at(ranges[0][0], b), at(ranges[0][1], b)], "#E2E2E2", 1);
    context.textAlign = "right";
    words(`grid ${+cell.toPrecision(2)} m`, width - 10, height - 12, "#444", "normal");
    context.textAlign = "left";
  }

  function words(text, x, y, colour, weight) {
    context.font = `${weight} 14px system-ui, sans-serif`;
    context.lineWidth = 3;
    context.strokeStyle = "rgba(255, 255, 255, 0.85)";
    context.strokeText(text, x, y);
    context.fillStyle = colour;
    context.fillText(text, x, y);
  }

  function triad(height) {
    const origin = [44, height - 44], axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    const ends = axes.map((axis, k) => ({ name: "xyz"[k], colour: ["#D55E00", "#009E73", "#0072B2"][k],
      tip: eye.map((way) => dot(way, axis)) })).sort((a, b) => a.tip[2] - b.tip[2]);
    for (const { name, colour, tip } of ends) {
      const end = [origin[0] + 28 * tip[0], origin[1] - 28 * tip[1]];
      stroke([origin, end], colour, 3);
      words(name, origin[0] + 37 * tip[0] - 4, origin[1] - 37 * tip[1] + 4, "#1a1a1a", "bold");
    }
  }

  function machine(frame, tint) {
    for (const [name, outline] of Object.entries(run.outlines)) {
      const body = run.bars[name], points = outline[frame], tints = run.stress?.rods[name]?.[frame];
      const colours = tints && ((k) => tint(tints, k).match(/\w\w/g).map((part) => parseInt(part, 16)));
      if (body) bar((body.axis || run.outlines[name])[frame], body.side && body.side[frame], body.size, body.clear, body.round, colours);
      if (body && !body.clear) continue;
      for (let k = 0; k + 1 < points.length; k += 1) line([points[k], points[k + 1]], "#0072B2", 4);
      if (!body) sprite(points[0], (p) => dots(p, 7, "#0072B2"));
    }
    for (const outline of Object.values(run.behind)) {
      for (let k = 0; k + 1 < outline[frame].length; k += 1) line(outline[frame].slice(k, k + 2), "#A0A0A0", 3);
    }
    const drawn = symbols(frame);
    for (const [name, ends] of Object.entries(run.links)) {
      if (!drawn.has(name)) line(ends[frame], "#767676", 1.5, run.slack[name]?.[frame] ? [5, 5] : []);
    }
    for (const axis of Object.values(run.axes)) {
      const [place, way] = axis[frame];
      for (const half of [-1, 1]) line([place, add(place, way, 0.1 * half * extent)], "#B06A00", 1.6, [9, 3, 2, 3]);
    }
  }

  // The symbols of the drawing: place + sum of coordinates times axes, of which a flat symbol has two.
  function symbols(frame) {
    const { unit, fine, looks, shapes, carriers, symbols } = run.drawing;
    if (unit * scale < fine) return new Set();
    for (const symbol of symbols) {
      const { place, axes } = carriers[symbol.by], look = looks[symbol.look];
      const o = place[Math.min(frame, place.length - 1)], a = axes[Math.min(frame, axes.length - 1)];
      const moved = (p) => p.reduce((sum, x, k) => add(sum, a.slice(3 * k, 3 * k + 3), x + symbol.at[k]), o);
      let part = [];
      for (const p of [...shapes[symbol.shape], [null]]) {
        if (p[0] !== null) part.push(moved(p));
        else {
          if (look.fill) filled(part, look);
          else for (let k = 0; k + 1 < part.length; k += 1) line([part[k], part[k + 1]], look.edge, look.width);
          part = [];
        }
      }
    }
    return new Set(symbols.map((symbol) => symbol.part));
  }

  function filled(places, look) {
    const points = places.map(to);
    let turn = 0;
    points.forEach((p, k) => { const q = points[(k + 1) % points.length]; turn += p[0] * q[1] - p[1] * q[0]; });
    if (look.solid && turn >= 0) return;  // seen from behind
    // What is turned away from the light is darker.
    const normal = unit(cross(add(places[1], places[0], -1), add(places[2], places[1], -1)));
    const bright = look.solid ? 0.72 + 0.28 * Math.max(0, dot(eye.map((axis) => dot(axis, normal)), light)) : 1;
    later(points, () => {
      trace(points);
      context.fillStyle = look.fill;
      context.fill();
      context.fillStyle = `rgba(0, 0, 0, ${(1 - bright).toFixed(3)})`;
      context.fill();
      context.strokeStyle = look.edge;
      context.lineWidth = look.width;
      context.stroke();
    }, 0.02 * extent);
  }

  function observed(frame) {
    const labels = {};
    for (const [name, path] of Object.entries(run.markers)) {
      for (let k = 0; k < frame; k += 4) line(path.slice(k, Math.min(k + 4, frame) + 1), "#E58E5A", 1.5);
      sprite(path[frame], (p) => dots(p, 3.5, VERMILION));
      const p = to(path[frame]);
      (labels[p.slice(0, 2).map(Math.round)] ||= { p, names: [] }).names.push(name);
    }
    for (const path of Object.values(run.measured)) {
      if (path[frame].some((x) => x === null)) continue;
      sprite(path[frame], (p) => {
        context.beginPath();
        context.arc(p[0], p[1], 7, 0, 2 * Math.PI);
        context.strokeStyle = BLACK;
        context.lineWidth = 2;
        context.stroke();
      });
    }
    return Object.values(labels);
  }

  function paint(frame, width, height, tint) {
    look(width, height);
    things = [];
    context.lineCap = context.lineJoin = "round";
    const below = camera.pitch < 0;
    if (!below) ground(width, height);
    context.lineCap = "butt";
    for (const [name, outline] of Object.entries(run.outlines)) {
      const body = run.bars[name], shadow = (body && body.axis || outline)[frame].map(down).map(to);
      stroke(shadow, "#D8D8D8", Math.max(2.5, body ? scale * Math.min(...body.size[0]) : 0));
    }
    context.lineCap = "round";
    machine(frame, tint);
    for (const place of run.drawing.unit * scale < run.drawing.fine ? run.ground : []) {
      sprite(place, (p) => { context.fillStyle = GREY; context.fillRect(p[0] - 5, p[1] - 5, 10, 10); });
    }
    const labels = observed(frame);
    things.sort((a, b) => a.depth - b.depth).forEach((thing) => thing.paint());
    if (below) ground(width, height);
    for (const { p, names } of labels) words(names.join(", "), p[0] + 11, p[1] - 9, BLACK, "bold");
    triad(height);
  }

  function turn(aside, upwards) {
    camera.yaw -= aside;
    camera.pitch = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, camera.pitch + upwards));
  }

  function zoom(factor, x = canvas.clientWidth / 2, y = canvas.clientHeight / 2) {
    const wanted = Math.max(0.2, Math.min(50, camera.zoom * factor)), ratio = wanted / camera.zoom;
    // What is under the pointer stays there.
    camera.x = (camera.x + canvas.clientWidth / 2 - x) * ratio + x - canvas.clientWidth / 2;
    camera.y = (camera.y + canvas.clientHeight / 2 - y) * ratio + y - canvas.clientHeight / 2;
    camera.zoom = wanted;
    redraw();
  }

  // The short way to a view, at once for who does not want motion.
  function go(target) {
    const start = { ...camera }, begin = performance.now();
    const still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
    const ahead = Math.round((start.yaw - target.yaw) / (2 * Math.PI)) * 2 * Math.PI;
    const step = (now) => {
      const share = still ? 1 : Math.min(1, Math.max(0, (now - begin) / 350)), ease = share * share * (3 - 2 * share);
      for (const key of Object.keys(target)) {
        camera[key] = start[key] + ease * (target[key] + (key === "yaw" ? ahead : 0) - start[key]);
      }
      redraw();
      if (share < 1) requestAnimationFrame(step);
    };
    step(begin);
  }

  const local = (event) => [event.offsetX, event.offsetY];
  const spread = () => { const [a, b] = [...pointers.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
  const between = () => { const [a, b] = [...pointers.values()]; return [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2]; };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, local(event));
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId), now = local(event);
    if (!before || pointers.size > 2) return;
    const [x, y] = [now[0] - before[0], now[1] - before[1]];
    if (pointers.size === 2) {
      const apart = spread(), centre = between();
      pointers.set(event.pointerId, now);
      const after = between();
      camera.x += after[0] - centre[0];
      camera.y += after[1] - centre[1];
      zoom(spread() / (apart || 1), ...after);
      return;
    }
    pointers.set(event.pointerId, now);
    if (event.shiftKey || event.buttons & 6) {
      camera.x += x;
      camera.y += y;
    } else turn(0.008 * x, 0.008 * y);
    redraw();
  });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => pointers.delete(event.pointerId));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("dblclick", () => go(home));
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(-0.0015 * event.deltaY * (event.deltaMode ? 16 : 1)), ...local(event));
  }, { passive: false });
  const step = Math.PI / 36;
  const keys = {
    ArrowLeft: () => turn(step, 0), ArrowRight: () => turn(-step, 0), ArrowUp: () => turn(0, -step), ArrowDown: () => turn(0, step),
    "+": () => zoom(1.25), "=": () => zoom(1.25), "-": () => zoom(0.8), "−": () => zoom(0.8),
    Home: () => go(home), " ": () => figure.querySelector("button.play").click(),
  };
  canvas.addEventListener("keydown", (event) => {
    if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    keys[event.key]();
    redraw();
  });
  figure.querySelectorAll("[data-view]").forEach((button) => button.addEventListener("click", () => {
    const [yaw, pitch] = run.views[button.dataset.view];
    go({ ...home, yaw, pitch });
  }));
  figure.querySelectorAll("[data-zoom]").forEach((button) => button.addEventListener("click", () => zoom(button.dataset.zoom)));
  return paint;
}
