// The form of a description: what its fields hold, what is wrong at them, and what the browser keeps of it.
"use strict";
(() => {
  // A tab keeps its own; what is kept for all is there when a new one is opened.
  studio.keep = (name, value) => {
    for (const place of [sessionStorage, localStorage]) place.setItem(name, JSON.stringify(value));
  };
  studio.kept = (name) => JSON.parse(sessionStorage.getItem(name) ?? localStorage.getItem(name) ?? "null");

  // What is being typed is left alone.
  function put(input, text) {
    const typing = document.activeElement === input && input.value !== (input.dataset.held ?? "");
    input.dataset.held = text;
    if (!typing) input.value = text;
  }

  studio.description = (fields, wrong) => {
    const form = document.getElementById("machine-form");
    const show = () => {
      for (const field of form.querySelectorAll(".field")) {
        const [text, usual, source] = fields[field.dataset.path] ?? ["", "", ""];
        const words = wrong[field.dataset.path] ?? "";
        const [value, from] = field.querySelectorAll("input");
        put(value, text);
        value.placeholder = usual;
        value.setAttribute("aria-invalid", words !== "");
        put(from, source);
        field.querySelector(".wrong").textContent = words;
        if (words) field.closest("details").open = true;
      }
    };
    requestAnimationFrame(show); // the form that came with it is there by then
  };

  document.addEventListener("change", (event) => {
    const input = event.target, field = input.closest?.("#machine-form .field");
    if (field && input.dataset.key) emitEvent("description-edited", [field.dataset.path, input.dataset.key, input.value]);
  });
})();
