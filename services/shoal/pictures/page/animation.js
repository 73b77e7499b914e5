// Draws the identified motion over the measured places on each canvas.animation; its data stand in the page as JSON.
"use strict";
const BLUE = "#0072B2", VERMILION = "#D55E00", BLACK = "#000000", ORANGE = "#E69F00", GREY = "#767676";

function animate(figure) {
  const run = JSON.parse(figure.querySelector("script[type='application/json']").textContent);
  const canvas = figure.querySelector("canvas"), slider = figure.querySelector("input");
  const button = figure.querySelector("button"), clock = figure.querySelector("output");
  const speed = figure.querySelector("select"), context = canvas.getContext("2d");
  const count = run.times.length, last = count - 1;
  let frame = 0, playing = false, before = 0, elapsed = 0;
  slider.max = last;

  const place = () => {
    const [left, bottom, right, top] = run.box, border = 64;
    const size = Math.min((canvas.width - 2 * border) / (right - left || 1),
                          (canvas.height - 2 * border) / (top - bottom || 1));
    const x0 = (canvas.width - size * (right - left)) / 2, y0 = (canvas.height - size * (top - bottom)) / 2;
    return { size, to: (p) => [x0 + size * (p[0] - left), canvas.height - y0 - size * (p[1] - bottom)] };
  };

  function line(points, colour, width) {
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.beginPath();
    points.forEach((p, k) => (k ? context.lineTo(...p) : context.moveTo(...p)));
    context.stroke();
  }

  function circle(p, radius, colour, filled) {
    context.beginPath();
    context.arc(p[0], p[1], radius, 0, 2 * Math.PI);
    context.strokeStyle = context.fillStyle = colour;
    context.lineWidth = 2;
    if (filled) context.fill(); else context.stroke();
  }

  function scaleBar(size, to) {
    const wanted = canvas.width / 5 / size, power = 10 ** Math.floor(Math.log10(wanted));
    const length = power * (wanted / power >= 5 ? 5 : wanted / power >= 2 ? 2 : 1);
    line([[14, canvas.height - 14], [14 + size * length, canvas.height - 14]], GREY, 3);
    context.fillStyle = "#444";
    context.font = "16px system-ui, sans-serif";
    context.fillText(`${+length.toPrecision(2)} m`, 14, canvas.height - 21);
  }

  function draw() {
    const { size, to } = place();
    context.clearRect(0, 0, canvas.width, canvas.height);
    context.lineCap = context.lineJoin = "round";
    for (const path of Object.values(run.markers)) line(path.slice(0, frame + 1).map(to), "#F0B48C", 2);
    for (const outline of Object.values(run.outlines)) {
      line(outline[frame].map(to), BLUE, 5);
      for (const end of [outline[frame][0], outline[frame].at(-1)]) circle(to(end), 5, BLUE, true);
    }
    for (const [name, path] of Object.entries(run.markers)) {
      const p = to(path[frame]);
      circle(p, 4.5, VERMILION, true);
      context.fillStyle = BLACK;
      context.font = "bold 18px system-ui, sans-serif";
      context.fillText(name, p[0] + 12, p[1] - 10);
    }
    for (const path of Object.values(run.measured)) {
      if (path[frame][0] !== null && path[frame][1] !== null) circle(to(path[frame]), 9, BLACK, false);
    }
    for (const [name, angles] of Object.entries(run.directions)) {
      const p = to(run.markers[name][frame]), a = angles[frame];
      if (a !== null) line([p, [p[0] + 46 * Math.cos(a), p[1] - 46 * Math.sin(a)]], ORANGE, 4);
    }
    scaleBar(size, to);
    slider.value = frame;
    clock.textContent = `t = ${run.times[frame].toFixed(3)} s`;
    slider.setAttribute("aria-valuetext", clock.textContent);
  }

  function tick(now) {
    if (!playing) return;
    elapsed += speed.value * (now - before) / 1000;
    before = now;
    const span = run.times[last] - run.times[0];
    if (elapsed > span) elapsed = 0;
    while (frame < last && run.times[frame + 1] - run.times[0] <= elapsed) frame += 1;
    if (run.times[frame] - run.times[0] > elapsed) frame = 0;
    draw();
    requestAnimationFrame(tick);
  }

  button.addEventListener("click", () => {
    playing = !playing;
    button.textContent = playing ? "Pause" : "Play";
    if (frame === last) frame = 0;
    elapsed = run.times[frame] - run.times[0];
    before = performance.now();
    if (playing) requestAnimationFrame(tick);
  });
  slider.addEventListener("input", () => {
    frame = Number(slider.value);
    elapsed = run.times[frame] - run.times[0];
    draw();
  });
  draw();
}

document.querySelectorAll("figure.animation").forEach(animate);
