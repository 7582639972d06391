// Page of a run that is not finished: it asks its server for new records.
"use strict";

async function startLive() {
  const data = JSON.parse(at("data").textContent);
  let version = "", page = null;
  at("live").hidden = false;
  for (;;) {
    let state;
    try {
      state = await (await fetch("state")).json();
    } catch (error) {
      at("live-text").textContent = "The run has ended, and its page is closed. fsm view shows the result.";
      return;
    }
    at("live-bar").value = state.fraction;
    at("live-text").textContent = `${(100 * state.fraction).toFixed(1)} %, ${state.seconds.toFixed(0)} s${state.done ? `, ${state.done}` : ""}`;
    if (state.version && state.version !== version) {
      const result = await (await fetch("data")).json().catch(() => ({}));
      if (result.name) {
        version = state.version;
        if (page) await page.renew(result);
        else page = await startPage({ ...data, results: [result] });
      }
    }
    fsmReport.state = state;
    if (state.done) return;
    await new Promise((resolve) => setTimeout(resolve, 1000));
  }
}
