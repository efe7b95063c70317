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

  let fields = {}, wrong = {};

  function show() {
    const form = document.getElementById("machine-form");
    for (const field of form?.querySelectorAll(".field") ?? []) {
      const [text, usual, source] = fields[field.dataset.path] ?? ["", "", ""];
      const words = wrong[field.dataset.path] ?? "";
      const [value, from] = field.querySelectorAll("input");
      put(value, text);
      value.placeholder = usual;
      value.setAttribute("aria-invalid", words !== "");
      put(from, source);
      const said = field.querySelector(".wrong");
      if (said.textContent !== words) said.textContent = words;
      if (words) field.closest("details").open = true;
    }
  }

  // Of the form only what has all words that are looked for, and a value of its own if that is asked for.
  function find() {
    const words = (document.getElementById("machine-search")?.value ?? "").toLowerCase().split(/\s+/).filter(Boolean);
    const given = document.getElementById("machine-given")?.checked, all = [...document.querySelectorAll("#machine-form .field")];
    let found = 0;
    for (const field of all) {
      const path = field.dataset.path, text = [path, ...(fields[path] ?? []), field.textContent].join(" ").toLowerCase();
      field.hidden = !words.every((one) => text.includes(one)) || (given && !fields[path]?.[0]);
      found += !field.hidden;
    }
    for (const group of document.querySelectorAll("#machine-form details")) {
      group.hidden = !group.querySelector(".field:not([hidden])");
      if (words.length && !group.hidden) group.open = true;
    }
    const said = document.getElementById("machine-found");
    if (said) said.textContent = `${found} of ${all.length} values`;
  }

  studio.description = (nowFields, nowWrong) => {
    [fields, wrong] = [nowFields, nowWrong];
    show();
    find();
    document.getElementById("machine-follows")?.classList.toggle("old", Object.keys(wrong).length > 0);
  };

  // A part of the circuit leads to the group that describes it, whatever the search leaves of the form; a button there
  // leads back.
  const back = Object.assign(document.createElement("button"), { type: "button", className: "small back", textContent: "back to the circuit" });
  const part = (event) => event.target.closest?.("#machine-circuit [data-section]");
  function lead(to) {
    const group = document.querySelector(`#machine-form details[data-group="${CSS.escape(to.dataset.section)}"]`);
    if (!group) return;
    const search = document.getElementById("machine-search"), given = document.getElementById("machine-given");
    if (group.hidden && search) { search.value = ""; given.checked = false; find(); }
    for (const one of document.querySelectorAll("#machine-circuit .led")) one.classList.remove("led");
    to.classList.add("led");
    group.open = true;
    group.scrollIntoView({ block: "center" });
    group.querySelector("summary").after(back);
    group.querySelector("summary").focus({ preventScroll: true });
    back.onclick = () => { to.scrollIntoView({ block: "center" }); to.focus({ preventScroll: true }); };
  }
  document.addEventListener("click", (event) => { if (part(event)) lead(part(event)); });
  document.addEventListener("keydown", (event) => {
    if (!part(event) || !["Enter", " "].includes(event.key)) return;
    event.preventDefault();
    lead(part(event));
  });
  for (const kind of ["focusin", "mouseover"]) document.addEventListener(kind, (event) => {
    const said = part(event) && document.getElementById("machine-part");
    if (said) said.textContent = part(event).getAttribute("aria-label");
  });

  // A form that is drawn again, or seen for the first time, is filled.
  addEventListener("DOMContentLoaded", () => {
    const empty = () => document.querySelector("#machine-form .field input:not([data-held])") && show();
    new MutationObserver(empty).observe(document.body, { childList: true, subtree: true });
  });

  document.addEventListener("input", (event) => { if (event.target.id === "machine-search") find(); });
  document.addEventListener("change", (event) => {
    if (event.target.id === "machine-given") find();
    const input = event.target, field = input.closest?.("#machine-form .field");
    if (field && input.dataset.key) emitEvent("description-edited", [field.dataset.path, input.dataset.key, input.value]);
  });
})();
