// The two panels on the left, of which one is in sight.

import { by } from './dom.js';

const tabs = [...document.querySelectorAll('[role=tab]')];

/** Brings the panel of this name into sight. */
export function turn(name) {
  for (const tab of tabs) {
    const on = tab.id === `tab-${name}`;
    tab.setAttribute('aria-selected', String(on));
    tab.tabIndex = on ? 0 : -1;
    by(tab.getAttribute('aria-controls')).hidden = !on;
  }
  by(name).dispatchEvent(new CustomEvent('turned'));
}

for (const tab of tabs) {
  tab.addEventListener('click', () => turn(tab.id.slice(4)));
  tab.addEventListener('keydown', (event) => {
    if (!['ArrowLeft', 'ArrowRight'].includes(event.key)) return;
    const other = tabs.find((one) => one !== tab);
    turn(other.id.slice(4));
    other.focus();
  });
}

// It must not change the address, which names what is shown.
document.querySelector('.skip').addEventListener('click', (event) => {
  event.preventDefault();
  turn('scenario');
  by('scenario').focus();
});
