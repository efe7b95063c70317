// Which strips are shown, and a link that leads to the machine as it is set and looked at.
"use strict";
(() => {
  const buttons = () => [...document.querySelectorAll("[data-strip]")];
  const isOn = (button) => button.getAttribute("aria-pressed") === "true";

  function put(name, on) {
    for (const place of [`strip-${name}`, ...(name === "status" ? ["strip-key"] : [])])
      document.getElementById(place)?.toggleAttribute("hidden", !on);
  }

  studio.strips = (names) => {
    for (const one of buttons()) {
      one.setAttribute("aria-pressed", `${names.includes(one.dataset.strip)}`);
      put(one.dataset.strip, isOn(one));
    }
    [strips, most] = [names, buttons().length];
  };

  const LATER = 300; // ms, in which several changes of the address become one: browsers limit them
  let asked = null, tab = "Live", waits = 0, strips = null, most = 0;

  // The server knows what the machine is set to, the page what is looked at of it.
  function described() {
    const found = new URLSearchParams(asked ?? location.search);
    const say = (name, value) => (value ? found.set(name, value) : found.delete(name));
    if (studio.shown()) say("unit", studio.shown() !== Object.keys(studio.units)[0] && studio.shown());
    if (strips) say("strips", strips.length < most && (strips.join(",") || "none"));
    say("span", studio.timeline.span() !== "2min" && studio.timeline.span());
    say("tab", tab !== "Live" && tab);
    const query = found.toString().replaceAll("%2C", ",");
    return `${location.origin}${location.pathname}${query && "?"}${query}`;
  }

  // The address keeps what is set, so that a page that is loaded again begins with it.
  studio.renew = () => {
    clearTimeout(waits);
    waits = setTimeout(() => history.replaceState(null, "", described()), LATER);
  };
  studio.address = (query) => { asked = query; studio.renew(); };
  studio.tab = (name) => { tab = name; studio.renew(); };

  // What a page that is loaded again has lost is said.
  const lost = JSON.parse(sessionStorage.getItem("held") ?? "{}");
  sessionStorage.removeItem("held");
  studio.holds = (what, name) => {
    const kept = { ...JSON.parse(sessionStorage.getItem("held") ?? "{}"), [what]: name };
    sessionStorage.setItem("held", JSON.stringify(kept));
  };
  studio.begun = () => {
    const place = document.getElementById("reloaded"), again = performance.getEntriesByType("navigation")[0]?.type === "reload";
    const { log, machine } = lost;
    if (place && again) place.textContent = "The page was loaded again: the machine begins from the start, in the same setting."
      + (machine ? ` The description of ${machine} runs no more: let it run again from the tab Machines.` : "")
      + (log ? ` The log ${log} is gone: drop it again.` : "");
  };

  studio.link = (query) => {
    asked = query;
    const address = described();
    history.replaceState(null, "", address);
    const field = document.getElementById("link");
    field.hidden = false;
    field.value = address;
    field.select();
    navigator.clipboard?.writeText(address).catch(() => {}); // a page that may not write there has the field
    return address;
  };

  addEventListener("click", (event) => {
    const button = event.target.closest?.("[data-strip]");
    if (!button) return;
    button.setAttribute("aria-pressed", `${!isOn(button)}`);
    put(button.dataset.strip, isOn(button));
    strips = buttons().filter(isOn).map((one) => one.dataset.strip); // kept: another tab has no buttons
    studio.renew();
  });
})();
