// Draws a machine in motion on each canvas of a figure.animation; its data stand in the page as JSON.
"use strict";
const BLUE = "#0072B2", VERMILION = "#D55E00", BLACK = "#000000", ORANGE = "#E69F00", GREY = "#767676";

function handy(wanted) {
  // The next smaller length of 1, 2 or 5 and zeros.
  const power = 10 ** Math.floor(Math.log10(wanted));
  return power * (wanted / power >= 5 ? 5 : wanted / power >= 2 ? 2 : 1);
}

function animate(figure) {
  const run = JSON.parse(figure.querySelector("script[type='application/json']").textContent);
  const canvas = figure.querySelector("canvas"), slider = figure.querySelector("input");
  const button = figure.querySelector("button.play"), clock = figure.querySelector("output");
  const speed = figure.querySelector("select"), context = canvas.getContext("2d");
  const count = run.times.length, last = count - 1;
  const space = run.views && spatial(run, figure, () => draw());
  let frame = 0, playing = false, before = 0, elapsed = 0, width = 0, height = 0;
  slider.max = last;

  function fit() {
    // As many dots as the screen has, so that lines and letters keep their size on a phone.
    const dots = window.devicePixelRatio || 1;
    width = canvas.clientWidth;
    height = canvas.clientHeight;
    canvas.width = Math.round(width * dots);
    canvas.height = Math.round(height * dots);
    context.setTransform(dots, 0, 0, dots, 0, 0);
    draw();
  }

  function place() {
    const [left, bottom, right, top] = run.box, border = 40;
    const size = Math.min((width - 2 * border) / (right - left || 1e-9), (height - 2 * border) / (top - bottom || 1e-9));
    const x0 = (width - size * (right - left)) / 2, y0 = (height - size * (top - bottom)) / 2;
    return { size, to: (p) => [x0 + size * (p[0] - left), height - y0 - size * (p[1] - bottom)] };
  }

  function line(points, colour, thickness, dashes = []) {
    context.strokeStyle = colour;
    context.lineWidth = thickness;
    context.setLineDash(dashes);
    context.beginPath();
    points.forEach((p, k) => (k ? context.lineTo(...p) : context.moveTo(...p)));
    context.stroke();
    context.setLineDash([]);
  }

  function circle(p, radius, colour, filled) {
    context.beginPath();
    context.arc(p[0], p[1], radius, 0, 2 * Math.PI);
    context.strokeStyle = context.fillStyle = colour;
    context.lineWidth = 2;
    if (filled) context.fill(); else context.stroke();
  }

  function text(words, x, y, colour, weight) {
    context.fillStyle = colour;
    context.font = `${weight} 14px system-ui, sans-serif`;
    context.fillText(words, x, y);
  }

  function scaleBar(size) {
    const length = handy(width / 5 / size);
    line([[12, height - 12], [12 + size * length, height - 12]], GREY, 3);
    text(`${+length.toPrecision(2)} m`, 12, height - 19, "#444", "normal");
  }

  function draw() {
    context.clearRect(0, 0, width, height);
    if (space) space(frame, width, height, tint); else plane();
    legend();
    slider.value = frame;
    clock.textContent = `t = ${run.times[frame].toFixed(3)} s`;
    slider.setAttribute("aria-valuetext", clock.textContent);
  }

  // The lines of a symbol in a frame: place + sum of coordinates times axes; see Carrier in Python.
  function moved(symbol) {
    const { kind, place, axes } = run.drawing.carriers[symbol.by], [x0, y0] = symbol.at;
    const o = place[Math.min(frame, place.length - 1)], a = axes[Math.min(frame, axes.length - 1)];
    const size = kind === "turned" ? 1 : 1 / (Math.hypot(a[0], a[1]) || 1);
    const [c, d] = kind === "any" ? [a[2], a[3]] : [-size * a[1], size * a[0]];
    return run.drawing.shapes[symbol.shape].map(([u, v]) => {
      const x = x0 + u, y = y0 + v;
      return u === null ? [null, null] : [o[0] + a[0] * x + c * y, o[1] + a[1] * x + d * y];
    });
  }

  function shape(points, to, look) {
    let part = [];
    for (const p of [...points, [null, null]]) {
      if (p[0] !== null) part.push(to(p));
      else if (part.length) {
        if (look.fill) {
          context.beginPath();
          part.forEach((q, k) => (k ? context.lineTo(...q) : context.moveTo(...q)));
          context.closePath();
          context.fillStyle = look.fill;
          context.fill();
        }
        line(part, look.edge, look.width);
        part = [];
      }
    }
  }

  // The colour of a part of a rod: that of the larger stress at its ends.
  function tint(levels, k) {
    return run.stress.palette[Math.max(parseInt(levels[k], 36), parseInt(levels[k + 1], 36))];
  }

  // The scale of stress, and what the picture has to state.
  function legend() {
    if (run.note) text(run.note, 12, 22, "#444", "bold");
    if (!run.stress) return;
    const { palette, label, most } = run.stress, bar = Math.min(180, width / 2), left = width - bar - 12;
    palette.forEach((colour, k) => {
      context.fillStyle = colour;
      context.fillRect(left + bar * k / palette.length, 10, bar / palette.length + 1, 12);
    });
    text(`${label}: 0 to ${most}`, left + bar - context.measureText(`${label}: 0 to ${most}`).width, 38, "#444", "normal");
  }

  // The outline of a rod that bends, with its thickness.
  function strip(points, half) {
    const normals = points.map((_, k) => {
      const a = points[Math.max(k - 1, 0)], b = points[Math.min(k + 1, points.length - 1)];
      const length = Math.hypot(b[0] - a[0], b[1] - a[1]) || 1;
      return [-(b[1] - a[1]) / length * half[k], (b[0] - a[0]) / length * half[k]];
    });
    const side = (sign) => points.map((p, k) => [p[0] + sign * normals[k][0], p[1] + sign * normals[k][1]]);
    const left = side(1);
    return [...left, ...side(-1).reverse(), left[0]];
  }

  function plane() {
    const { size, to } = place(), { unit, fine, looks, symbols } = run.drawing, detailed = unit * size >= fine;
    context.lineCap = context.lineJoin = "round";
    for (const p of detailed ? [] : run.ground.map(to)) {
      context.fillStyle = GREY;
      context.fillRect(p[0] - 5, p[1] - 5, 10, 10);
    }
    for (const path of Object.values(run.markers)) line(path.slice(0, frame + 1).map(to), "#F0B48C", 1.5);
    for (const outline of Object.values(run.behind)) line(outline[frame].map(to), "#A0A0A0", 3);
    const drawn = new Set(detailed ? symbols.map((symbol) => symbol.part) : []);
    for (const [name, ends] of Object.entries(run.links)) {
      if (!drawn.has(name)) line(ends[frame].map(to), GREY, 1.5, run.slack[name]?.[frame] ? [5, 5] : []);
    }
    const things = symbols.filter((symbol) => detailed || run.drawing.always.includes(symbol.look))
      .map((symbol) => ({ look: looks[symbol.look], draw: (look) => shape(moved(symbol), to, look) }));
    for (const [name, outline] of Object.entries(run.outlines)) {
      const half = run.half[name];
      things.push({ look: looks.body, draw: (look) => {
        const tints = run.stress?.rods[name]?.[frame];
        if (half && tints) {
          for (let k = 0; k + 1 < tints.length; k += 1) {
            const colour = tint(tints, k);
            shape(strip(outline[frame].slice(k, k + 2), half.slice(k, k + 2)), to, { fill: colour, edge: colour, width: 0.5 });
          }
          shape(strip(outline[frame], half), to, { edge: "#4A4A4A", width: 1 });
        } else if (half) shape(strip(outline[frame], half), to, look);
        else line(outline[frame].map(to), BLUE, 4);
      } });
    }
    things.sort((a, b) => a.look.layer - b.look.layer).forEach(({ look, draw }) => draw(look));
    for (const [name, angles] of Object.entries(run.directions)) {
      const p = to(run.markers[name][frame]), a = angles[frame];
      if (a !== null) line([p, [p[0] + 34 * Math.cos(a), p[1] - 34 * Math.sin(a)]], ORANGE, 3);
    }
    const labels = {};
    for (const [name, path] of Object.entries(run.markers)) {
      const p = to(path[frame]);
      circle(p, 3.5, VERMILION, true);
      (labels[p.map(Math.round)] ||= { p, names: [] }).names.push(name);
    }
    for (const { p, names } of Object.values(labels)) text(names.join(", "), p[0] + 11, p[1] - 9, BLACK, "bold");
    for (const path of Object.values(run.measured)) {
      if (path[frame][0] !== null && path[frame][1] !== null) circle(to(path[frame]), 7, BLACK, false);
    }
    scaleBar(size);
  }

  function tick(now) {
    if (!playing) return;
    elapsed += speed.value * (now - before) / 1000;
    before = now;
    const span = run.times[last] - run.times[0];
    if (elapsed > span) elapsed = 0;
    if (run.times[frame] - run.times[0] > elapsed) frame = 0;
    while (frame < last && run.times[frame + 1] - run.times[0] <= elapsed) frame += 1;
    draw();
    requestAnimationFrame(tick);
  }

  function start(now) {
    if (frame === last) frame = 0;
    elapsed = run.times[frame] - run.times[0];
    before = now;
    requestAnimationFrame(tick);
  }

  button.addEventListener("click", () => {
    playing = !playing;
    button.textContent = playing ? "Pause" : "Play";
    if (playing) requestAnimationFrame(start);
  });
  slider.addEventListener("input", () => {
    frame = Number(slider.value);
    elapsed = run.times[frame] - run.times[0];
    draw();
  });
  window.addEventListener("resize", fit);
  window.addEventListener("beforeprint", fit);
  window.addEventListener("afterprint", fit);
  fit();
}

document.querySelectorAll("figure.animation").forEach(animate);
