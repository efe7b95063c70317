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
  };

  // The server knows what the machine is set to, the page what is looked at of it.
  studio.link = (query) => {
    const found = new URLSearchParams(query), all = buttons(), on = all.filter(isOn).map((one) => one.dataset.strip);
    if (studio.shown() !== Object.keys(studio.units)[0]) found.set("unit", studio.shown());
    if (on.length < all.length) found.set("strips", on.join(",") || "none");
    const address = `${location.origin}${location.pathname}?${found.toString().replaceAll("%2C", ",")}`;
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
  });
})();
