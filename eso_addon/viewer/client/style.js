// SPDX-License-Identifier: GPL-3.0-or-later
// How the viewer looks, light and dark, large and small.

export const STYLE = `
:host { display: block; position: relative; height: 480px; min-height: 240px; border-radius: 12px; overflow: hidden;
  contain: content; container-type: inline-size; color-scheme: light dark;
  --ink: light-dark(#1b2430, #e8edf5); --soft: light-dark(#5c6878, #9aa7b8); --card: light-dark(#ffffffe6, #1b212be6);
  --rim: light-dark(#1b24301f, #ffffff26); --back: light-dark(#f4f6f9, #262d38); --edge: light-dark(#d5dbe4, #10141a);
  --accent: light-dark(#2563eb, #7aa7ff); --good: light-dark(#0f7a45, #5fd39a); --bad: light-dark(#b3261e, #ff9a92);
  color: var(--ink); accent-color: var(--accent); font: 14px/1.4 system-ui, sans-serif;
  background: radial-gradient(120% 90% at 50% 38%, var(--back), var(--edge)); }
[hidden] { display: none !important; }
canvas { position: absolute; inset: 0; width: 100%; height: 100%; cursor: grab; outline-offset: -2px; touch-action: none; }
.card { position: absolute; left: 50%; transform: translateX(-50%); box-sizing: border-box; background: var(--card);
  border: 1px solid var(--rim); border-radius: 14px; padding: 10px 14px 12px; }
header { position: absolute; inset: 14px 14px auto; pointer-events: none; overflow-wrap: anywhere; }
b { font-size: 17px; margin-right: 8px; }
.state, dt, small, label { color: var(--soft); }
.same { color: var(--good); font-weight: 600; }
.message { top: 60px; width: max-content; max-width: min(440px, 100% - 28px); display: flex; gap: 12px; align-items: center;
  border-left: 4px solid var(--bad); }
.bar { bottom: max(14px, env(safe-area-inset-bottom)); width: min(720px, 100% - 28px); }
.row { display: flex; align-items: center; gap: 4px; }
button { font: inherit; color: inherit; background: none; border: 0; border-radius: 10px; min-width: 40px; height: 40px;
  cursor: pointer; flex: none; display: grid; place-items: center; }
button:disabled { opacity: 0.35; pointer-events: none; }
.again, button:hover { background: var(--rim); }
button[aria-pressed=true] { background: var(--accent); color: var(--back); }
:focus-visible { outline: 2px solid var(--accent); }
svg { width: 20px; fill: none; stroke: currentColor; stroke-width: 1.8; stroke-linejoin: round; }
input { flex: 1; min-width: 60px; height: 40px; }
dl, form { display: grid; grid-template-columns: repeat(4, 1fr); gap: 2px 14px; margin: 4px 2px; }
dt, small, label { font-size: 12px; font-weight: 400; }
dd { margin: 0; font-variant-numeric: tabular-nums; font-weight: 600; white-space: nowrap; }
progress { width: 100%; height: 6px; display: block; }
form { grid-template-columns: repeat(3, 1fr); gap: 10px 14px; margin-top: 12px; }
select { display: block; font: inherit; font-size: 14px; width: 100%; height: 38px; margin-top: 3px; padding: 0 6px; color: var(--ink);
  background: var(--back); border: 1px solid var(--rim); border-radius: 8px; }
@container (max-width: 520px) {
  dl, form { grid-template-columns: 1fr 1fr; }
  form { max-height: 38vh; overflow: auto; }
}
`;
