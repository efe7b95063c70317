// A link that leads to the machine as it is set and looked at.
"use strict";
(() => {
  const LATER = 300; // ms, in which several changes of the address become one: browsers limit them
  let asked = null, tab = "Live", waits = 0;

  // The server knows what the machine is set to, the page what is looked at of it.
  function described() {
    const found = new URLSearchParams(asked ?? location.search);
    const say = (name, value) => (value ? found.set(name, value) : found.delete(name));
    if (studio.shown()) say("unit", studio.shown() !== Object.keys(studio.units)[0] && studio.shown());
    if (studio.shown()) say("strips", studio.stripsText());
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
})();
