// Numbers and states as people read them.

import { at } from './draft.js';

const plain = new Map();
function digits(count) {
  if (!plain.has(count)) plain.set(count, new Intl.NumberFormat('en', { maximumFractionDigits: count, minimumFractionDigits: count }));
  return plain.get(count);
}

/** With so many decimals; a dash for nothing. */
export const number = (value, decimals = 1) => (value === null || value === undefined || !Number.isFinite(value) ? '–' : digits(decimals).format(value).replace(/^-([0.,]+)$/, '$1').replace('-', '−'));

/** Metres, as kilometres from ten thousand on. */
export const metres = (value, decimals = 1) =>
  value !== null && Math.abs(value) >= 10000 ? `${number(value / 1000, 2)} km` : `${number(value, decimals)} m`;

/** A place of a route: how far along, how high, and how high above ground as far as that is known. */
export function placeText({ distance, z, ground }) {
  const above = ground.guessed ? '' : `, ${ground.sure ? '' : 'about '}${number(z - ground.z, 0)} m above ground`;
  return `${metres(distance, 0)}: ${number(z, 0)} m${above}`;
}

/** A length of a file. */
export function bytes(count) {
  const [power, unit] = count >= 1e9 ? [1e9, 'GB'] : count >= 1e6 ? [1e6, 'MB'] : [1e3, 'kB'];
  return `${number(count / power)} ${unit}`;
}

/** A cost: four or five significant figures. */
export const cost = (value) => number(value, value >= 1e5 ? 0 : value >= 1000 ? 1 : 2);

/** A share in per cent. */
export const share = (value) => (value === null || value === undefined ? '–' : `${number(value * 100, value < 0.1 ? 2 : 1)} %`);

/** A share that is proven to be no greater: never rounded down, but for the last bits of its sum. */
export function proven(value) {
  if (value === null || value === undefined) return share(value);
  const scale = value < 0.1 ? 1e4 : 1e3;
  return share(Math.ceil(value * scale - 1e-6) / scale);
}

/** Seconds as minutes and seconds. */
export function duration(seconds) {
  if (seconds === null || seconds === undefined) return '–';
  if (seconds < 100) return `${number(seconds, 1)} s`;
  const whole = Math.round(seconds);
  const hours = Math.floor(whole / 3600);
  const minutes = Math.floor((whole % 3600) / 60);
  const rest = String(whole % 60).padStart(2, '0');
  return hours ? `${hours} h ${String(minutes).padStart(2, '0')} min` : `${minutes}:${rest} min`;
}

/** How long ago, or the day. */
export function moment(text) {
  const then = new Date(text);
  const day = then.toDateString() === new Date().toDateString();
  return day ? then.toLocaleTimeString('en-GB') : then.toLocaleDateString('en-GB', { day: 'numeric', month: 'short', hour: '2-digit', minute: '2-digit' });
}

/** A round step that divides `span` into about `parts`. */
export function step(span, parts) {
  const raw = span / parts;
  const power = 10 ** Math.floor(Math.log10(raw));
  const lead = raw / power;
  return (lead < 1.5 ? 1 : lead < 3.5 ? 2 : lead < 7.5 ? 5 : 10) * power;
}

/** So many decimals tell multiples of a step apart. */
export const decimalsOf = (size) => Math.max(0, -Math.floor(Math.log10(size) + 1e-9));

/** `1,000`: a thousand to one reader, one to the other. */
export const EITHER = /^[+-]?[1-9]\d{0,2},\d{3}$/;

/** What is wrong in the words of the service, which does not know how a number may be read. */
export function detailOf({ pointer, detail }, document) {
  const value = at(document, pointer);
  if (typeof value !== 'string' || !EITHER.test(value.trim())) return detail;
  const [whole, decimals] = value.trim().split(',');
  return `${value.trim()} can be read in two ways: write ${whole}${decimals} or ${whole}.${decimals.replace(/0{1,2}$/, '')}`;
}

/** What is wrong with a scenario, and with which of its ends or threats. */
export function faultText(fault, document) {
  const [pointer, detail] = [fault.pointer, detailOf(fault, document)];
  const [, end, index] = pointer.match(/^\/(start|target|threats\/(\d+))\/./) ?? [];
  if (!end) return detail;
  return `${index === undefined ? end : threatName(document.threats?.[index], index)}: ${detail}`;
}

/** A threat's name, or its number. */
export const threatName = (threat, at) => threat?.name || `threat ${at}`;
