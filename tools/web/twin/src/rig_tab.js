// The studio's tab for the rig behind a drive in the browser: load, true resistance, what breaks.

import { h, setText } from "../../src/app/dom.js";
import { FAULTS, Hand } from "./hand.js";

const RATED_NM = 8.4;

export function rigTab(rig) {
  const hand = new Hand();
  const change = () => rig.change(hand.scenario());
  const speed = h("strong", { id: "true-speed" });
  rig.addEventListener("speed", ({ detail }) => setText(speed, `${detail.toFixed(1)} min⁻¹`));
  const slider = (name, low, high, step, value, unit, take) => {
    const said = h("output", {});
    const input = h("input", { type: "range", min: low, max: high, step, value, "aria-label": name });
    const told = () => setText(said, `${input.value} ${unit}`);
    input.addEventListener("input", () => {
      take(Number(input.value));
      told();
      change();
    });
    told();
    return h("label", { class: "rig-slider" }, h("span", {}, name, " ", said), input);
  };
  const buttons = Object.entries(FAULTS).map(([name, { title }]) => {
    const button = h("button", { type: "button", onclick: () => {
      hand.toggle(name);
      buttons.forEach((other) => other.setAttribute("aria-pressed", hand.faults.has(other.dataset.fault)));
      change();
    } }, title);
    button.dataset.fault = name;
    button.setAttribute("aria-pressed", "false");
    return button;
  });
  const element = h("section", { class: "card rig" },
    h("p", {}, "What a board has at its terminals is simulated here. True speed of the shaft: ", speed),
    slider("Load, positive: it brakes", -130, 130, 1, 0, "% of rated", (v) => (hand.load_Nm = (v / 100) * RATED_NM)),
    slider("True stator resistance", 0.5, 2, 0.01, 1, "× nameplate", (v) => (hand.rs_ratio = v)),
    h("h2", {}, "Break something"),
    h("div", { class: "row" }, buttons));
  return { element };
}
