// The machine in space is drawn while something moves in it: without a graphics card a picture takes as long as all strips.
"use strict";
(() => {
  const AFTER = 1000; // ms that it is still drawn after the last change, so that what is on its way arrives
  const BEGIN = 5000; // ms, in which everything gets there at first
  const SLOW = 700; // ms, from one picture to the next meanwhile: what makes the machine ready has the processor
  const LEAST = 0.05; // mm
  let until = 0, quick = 0, drawn = 0, last = "";

  const wake = () => { until = Math.max(until, quick = performance.now() + AFTER); };

  // Whatever is done to the page may turn the picture, or change how large an error is in it.
  for (const kind of ["pointerdown", "pointermove", "wheel", "keydown", "resize"]) addEventListener(kind, () => wake(), { passive: true });
  document.addEventListener("visibilitychange", () => wake());

  // The colours of the page, not those that the scene was made with.
  let tint = () => {};
  function tinted(own) {
    let ground = "#e9edf0"; // as in scene.py
    return () => {
      const wanted = studio.css("--space");
      own.renderer.setClearColor(wanted);
      own.scene.traverse((one) => { if (one.material?.color?.getHexString() === ground.slice(1)) one.material.color.set(wanted); });
      ground = wanted;
      wake();
    };
  }
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => setTimeout(() => tint(), 100));

  // Shadows on the ground and on the machine: of what is solid, by the light that is there.
  // Soft edges, and a new shadow with each picture, would take a processor longer than all the rest.
  const REACH = 8, SHARP = 1024, HARD = 0, SELDOM = 3; // m around the machine; pixels of the shadow's picture; BasicShadowMap; pictures from one shadow to the next
  function shadowed({ renderer, scene }) {
    Object.assign(renderer.shadowMap, { enabled: true, type: HARD, autoUpdate: false });
    scene.traverse((one) => {
      if (one.isMesh) [one.castShadow, one.receiveShadow] = [!(one.material.opacity < 1), true];
      if (!one.isDirectionalLight) return;
      one.castShadow = true;
      one.shadow.mapSize.set(SHARP, SHARP);
      Object.assign(one.shadow.camera, { left: -REACH, right: REACH, top: REACH, bottom: -REACH });
      one.shadow.normalBias = 0.03; // m
    });
  }

  // Where forwards (x), left (y) and up (z) are, in a corner of the picture.
  const AXES = [["x", "#c0392b"], ["y", "#2e7d32"], ["z", "#2a6fb5"]], ARM = 22, MIDDLE = 34; // pixels
  function axes(place) {
    place.style.position = "relative";
    const corner = studio.element("svg", { class: "axes", width: 2 * MIDDLE, height: 2 * MIDDLE, "aria-hidden": "true" });
    const arms = AXES.map(([name, colour]) => [
      corner.appendChild(studio.element("line", { x1: MIDDLE, y1: MIDDLE, stroke: colour, "stroke-width": 3 })),
      corner.appendChild(studio.element("text", { "text-anchor": "middle", "dominant-baseline": "central" }, name)),
    ]);
    place.append(corner);
    return (camera) => arms.forEach(([line, text], k) => {
      const [right, up] = camera.matrixWorldInverse.elements.slice(4 * k, 4 * k + 2);
      for (const [name, way] of [["x", right], ["y", -up]]) {
        line.setAttribute(`${name}2`, (MIDDLE + ARM * way).toFixed(1));
        text.setAttribute(name, (MIDDLE + (ARM + 7) * way).toFixed(1));
      }
    });
  }

  // A view of one's own, of each machine: the browser keeps it.
  const viewed = () => `view of ${document.title}`;
  const offer = () => document.getElementById("kept-view")?.classList.toggle("none", localStorage.getItem(viewed()) === null);
  let looking = null;
  studio.keepView = () => {
    localStorage.setItem(viewed(), JSON.stringify([...looking.camera.position, ...looking.controls.target]));
    offer();
  };
  studio.keptView = () => {
    looking.move_camera(...JSON.parse(localStorage.getItem(viewed())), 0, 0, 1, 0.5);
    wake();
  };

  studio.space = (id) => {
    const own = getElement(id), renderer = own.renderer, render = renderer.render.bind(renderer);
    tint = tinted(own);
    looking = own;
    offer();
    const point = axes(own.$el);
    renderer.domElement.setAttribute("role", "img");
    renderer.domElement.setAttribute("aria-label", "the machine in space; red and pale: where the sensor takes it to be; the fan: its 95 % band");
    tint();
    const begun = performance.now();
    studio.watch(own.$el, wake);
    until = begun + BEGIN;
    studio.pictures = 0;
    renderer.render = (...all) => {
      const now = performance.now();
      if (now > until || (now > quick && now < drawn + SLOW) || !studio.isSeen(own.$el)) return;
      drawn = now;
      if (now < begun + BEGIN) shadowed(own); // of what has come since
      renderer.shadowMap.needsUpdate = studio.pictures++ % SELDOM === 0;
      render(...all);
      point(own.camera);
    };
  };

  // What a frame says of where everything is; what is within a twentieth of a millimetre stands.
  studio.moved = (f) => {
    const round = (v) => Math.round((v ?? 0) / LEAST);
    const now = JSON.stringify([f.load, Object.values(f.columns).map((one) => [round(one.position?.at(-1)), round(one.kalman?.at(-1))])]);
    if (now !== last) wake();
    last = now;
  };
})();
