// The jobs behind the sliders: an experiment as it is given, and with what was changed by hand.

function number_of(lines, name) {
  const found = [...lines.matchAll(new RegExp(`^${name}=(.*)$`, "gm"))].at(-1);
  return found ? Number(found[1]) : undefined;
}

// The tuning by its name; on the bench of the atlas the firmware is also told the nameplate.
function tuning(experiment, name, data) {
  return experiment.job.rig === "atlas" ? data.live[name] : data.tunings[name];
}

export function given(experiment, data) {
  const { job } = experiment;
  const scenario = (name) => Number(experiment.firmware?.[name] ?? number_of(job.config, name) ?? data.defaults[name]);
  return {
    config: Object.keys(data.live).find((name) => data.live[name].motor === job.motor && name !== "no_gain"),
    gain: scenario("observer_gain_enable") !== 0,
    eps1_mode: scenario("eps1_mode"),
    eps1: 1,
    rs: 1,
  };
}

// The job of an experiment with other settings; the same object when nothing differs.
export function changed(experiment, settings, data) {
  const as_given = given(experiment, data);
  const other = { ...experiment.job };
  const firmware = [other.firmware];
  if (settings.config !== as_given.config) {
    const { config, motor } = tuning(experiment, settings.config, data);
    Object.assign(other, { config, motor });
  }
  const eps1 = number_of(other.config, "eps1") ?? data.defaults.eps1;
  if (settings.gain !== as_given.gain || settings.config !== as_given.config) {
    firmware.push(`observer_gain_enable=${settings.gain ? 1 : 0}`);
  }
  if (settings.eps1_mode !== as_given.eps1_mode || settings.config !== as_given.config) {
    firmware.push(`eps1_mode=${settings.eps1_mode}`);
  }
  if (settings.eps1 !== 1) {
    firmware.push(`eps1=${eps1 * settings.eps1}`);
  }
  if (settings.rs !== 1) {
    other.scenario_overrides = [other.scenario_overrides, `profiles.rs_factor=[[0.0, ${settings.rs}]]`]
      .filter(Boolean).join("\n");
  }
  const same = JSON.stringify(settings) === JSON.stringify(as_given);
  return same ? experiment.job : { ...other, firmware: firmware.filter(Boolean).join("\n") };
}

export function eps1_of(experiment, settings, data) {
  const { config } = tuning(experiment, settings.config, data);
  return settings.eps1 * (number_of(config, "eps1") ?? data.defaults.eps1);
}
