/** What the scope can draw: the drive's signals, and speeds as people read them. */

import { RPM_PER_RAD_S } from './session.js';

/** Name on the page -> signal of the drive, electrical rad/s. */
const IN_RPM = {
  speed_rpm: ['omega_e_hat_rad_s', 'estimated speed'],
  speed_ref_rpm: ['omega_ref_rad_s', 'speed reference behind the slew limit'],
  speed_bound_rpm: ['omega_bound_rad_s', 'bound of the speed error'],
};
export const BAND_OF = { speed_rpm: 'speed_bound_rpm' };

const PALETTE = ['--plot-1', '--plot-2', '--plot-3', '--plot-4', '--plot-5', '--plot-6', '--plot-7', '--plot-8'];

export const colourOf = (k) => getComputedStyle(document.documentElement).getPropertyValue(PALETTE[k % PALETTE.length]).trim();

/** Names that can be chosen. */
export const choosable = (client) => [...Object.keys(IN_RPM), ...client.signals.keys()];

/** The drive's signals behind these names, bands included. */
export function rawOf(names) {
  const all = new Set();
  for (const name of names) {
    all.add(IN_RPM[name]?.[0] ?? name);
    if (BAND_OF[name]) all.add(IN_RPM[BAND_OF[name]][0]);
  }
  return [...all];
}

/** The column of a name, made from what was recorded; null when that has not got it. */
export function columnOf(name, columns, polePairs) {
  const made = IN_RPM[name];
  const raw = columns.get(made ? made[0] : name);
  if (!raw || !made) return raw ?? null;
  return raw.map((value) => (value === null ? null : (value * RPM_PER_RAD_S) / polePairs));
}

export const textOf = (name, catalog) => IN_RPM[name]?.[1] ?? catalog.signals[name]?.text ?? '';

export const unitOf = (name, catalog) => (IN_RPM[name] ? 'min⁻¹' : (catalog.signals[name]?.unit ?? ''));

/** Panes for a recording of unknown signals: one per unit. */
export function panesByUnit(names, catalog) {
  const panes = new Map();
  for (const name of names) {
    const unit = unitOf(name, catalog) || name; // bare numbers each on their own
    panes.set(unit, [...(panes.get(unit) ?? []), name]);
  }
  return [...panes.values()];
}
