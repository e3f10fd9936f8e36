// Entry of studio.html: the studio without a computer behind it, on a drive in this page or on a board
// at a serial port.

import { startStudio } from "../../src/app/shell.js";
import { hasWebSerial, webSerialTransport } from "../../src/link/transport.js";
import { unpacked } from "./client.js";
import { rigTab } from "./rig_tab.js";
import { Hand } from "./hand.js";
import { TwinRig } from "./twin_transport.js";

const el = (id) => document.getElementById(id);

function begin(wiring) {
  el("choice").remove();
  startStudio(el("studio"), { catalog: window.zhCatalog, tools: null, ...wiring });
}

async function simulated() {
  const [wasm, text] = await Promise.all([unpacked("wasm"), unpacked("data")]);
  const { data, job, period_s } = JSON.parse(new TextDecoder().decode(text));
  const start = () => ({ wasm, data, job: { ...job, scenario: new Hand().scenario() }, period_s });
  const rig = new TwinRig(el("worker").textContent, start);
  begin({ transport: () => rig.transport(), extra: [["Rig", rigTab(rig)]] });
}

el("simulated").onclick = simulated;
el("board").onclick = () => begin({ transport: () => webSerialTransport() });
el("board").disabled = !hasWebSerial();
el("no-serial").hidden = hasWebSerial();
