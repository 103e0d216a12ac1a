// SPDX-License-Identifier: GPL-3.0-or-later
// How the viewer looks, light and dark, large and small.

export const STYLE = `
:host { display: block; position: relative; height: 480px; min-height: 240px; border-radius: 12px; overflow: hidden;
  contain: content; container-type: inline-size;
  --ink: #1b2430; --soft: #5c6878; --card: #ffffffd9; --rim: #1b243017; --back: #f4f6f9; --edge: #d5dbe4; --accent: #2563eb;
  --good: #0f7a45; --bad: #b3261e; --track: #1b24301f;
  color: var(--ink); font: 14px/1.4 system-ui, -apple-system, "Segoe UI", Roboto, sans-serif; }
:host([dark]) { --ink: #e8edf5; --soft: #9aa7b8; --card: #1b212bd9; --rim: #ffffff1a; --back: #262d38; --edge: #10141a;
  --accent: #7aa7ff; --good: #5fd39a; --bad: #ff9a92; --track: #ffffff26; }
:host { background: radial-gradient(120% 90% at 50% 38%, var(--back), var(--edge)); }
[hidden] { display: none !important; }
canvas { position: absolute; inset: 0; width: 100%; height: 100%; outline: none; cursor: grab; }
canvas:active { cursor: grabbing; }
canvas:focus-visible { box-shadow: inset 0 0 0 2px var(--accent); }
.card { background: var(--card); border: 1px solid var(--rim); border-radius: 14px; backdrop-filter: blur(14px);
  -webkit-backdrop-filter: blur(14px); box-shadow: 0 6px 24px #0b12201f; }
.title { position: absolute; left: max(14px, env(safe-area-inset-left)); top: max(14px, env(safe-area-inset-top));
  right: 14px; display: flex; flex-wrap: wrap; gap: 4px 10px; align-items: baseline; pointer-events: none; }
.title b { font-size: 17px; font-weight: 650; letter-spacing: -0.01em; overflow-wrap: anywhere; }
.state { color: var(--soft); }
.state.same { color: var(--good); font-weight: 600; }
.message { position: absolute; left: 50%; top: 60px; transform: translateX(-50%); width: max-content;
  max-width: min(440px, calc(100% - 28px)); box-sizing: border-box; padding: 12px 14px; display: flex; gap: 12px;
  align-items: center; border-left: 4px solid var(--bad); }
.message button { flex: none; }
.bar { position: absolute; left: 50%; bottom: max(14px, env(safe-area-inset-bottom)); transform: translateX(-50%);
  width: min(720px, calc(100% - 28px)); box-sizing: border-box; padding: 10px 14px 12px; }
.row { display: flex; align-items: center; gap: 6px; }
button { font: inherit; color: inherit; background: none; border: 1px solid transparent; border-radius: 10px; min-width: 40px;
  min-height: 40px; padding: 0 9px; cursor: pointer; display: inline-grid; place-items: center; }
button:disabled { opacity: 0.35; cursor: default; }
button:hover:enabled { background: var(--track); }
button[aria-pressed=true], button[aria-expanded=true] { background: var(--accent); color: var(--edge); }
:host(:not([dark])) button[aria-pressed=true], :host(:not([dark])) button[aria-expanded=true] { color: #fff; }
button:focus-visible, select:focus-visible, input:focus-visible { outline: 2px solid var(--accent); outline-offset: 2px; }
.message button { border-color: var(--rim); padding: 0 14px; font-weight: 600; }
svg { width: 20px; height: 20px; fill: none; stroke: currentColor; stroke-width: 1.8; stroke-linecap: round;
  stroke-linejoin: round; display: block; }
.slide { flex: 1; min-width: 60px; position: relative; height: 40px; display: grid; align-items: center; }
.slide input { -webkit-appearance: none; appearance: none; width: 100%; height: 40px; margin: 0; background: none; cursor: pointer; }
.slide i { position: absolute; left: 0; right: 0; height: 6px; border-radius: 3px; pointer-events: none;
  background: linear-gradient(90deg, var(--accent) var(--shown, 0%), color-mix(in srgb, var(--accent) 38%, transparent) 0
  var(--there, 0%), var(--track) 0); }
.slide input::-webkit-slider-thumb { -webkit-appearance: none; width: 20px; height: 20px; border-radius: 50%; position: relative;
  background: #fff; border: 1px solid #0003; box-shadow: 0 1px 5px #0005; }
.slide input::-moz-range-thumb { width: 18px; height: 18px; border-radius: 50%; background: #fff; border: 1px solid #0003; }
dl { display: grid; grid-template-columns: repeat(4, 1fr); gap: 2px 14px; margin: 6px 2px 0; }
dl div { min-width: 0; }
dt { color: var(--soft); font-size: 12px; }
dd { margin: 0; font-variant-numeric: tabular-nums; font-weight: 600; white-space: nowrap; }
dd small { color: var(--soft); font-weight: 400; font-size: 12px; }
.load { height: 3px; border-radius: 2px; margin: 8px 2px 0; background: var(--track); overflow: hidden; }
.load i { display: block; height: 100%; width: var(--got, 0%); background: var(--accent); border-radius: 2px; }
.same .load i { background: var(--good); }
.settings { display: grid; grid-template-columns: repeat(3, 1fr); gap: 10px 14px; margin: 12px 2px 2px; padding-top: 12px;
  border-top: 1px solid var(--rim); }
.settings label { display: grid; gap: 3px; color: var(--soft); font-size: 12px; }
.settings select { font: inherit; font-size: 14px; color: var(--ink); background: var(--back); border: 1px solid var(--rim);
  border-radius: 8px; padding: 7px 8px; min-height: 38px; width: 100%; }
@container (max-width: 520px) {
  .bar { padding: 6px 10px 10px; }
  dl { grid-template-columns: repeat(2, 1fr); }
  .row { gap: 2px; }
  .settings { grid-template-columns: repeat(2, 1fr); max-height: 38vh; overflow: auto; }
}
`;
