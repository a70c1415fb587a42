// SPDX-License-Identifier: Apache-2.0
// A difference and its interval in words, as the sentences have them.
import {number, withUnit} from './dom.js';

export const other = (item) => item.reference ?? 'the baseline';

const sideOf = (value, metric) => ((value > 0) === Boolean(metric.higher_is_better) ? 'better' : 'worse');

// "0.12 mm worse", as in the sentences. 0 is neither.
const amount = (value, metric) =>
    withUnit(Math.abs(value), metric.unit) + (value === 0 ? '' : ' ' + sideOf(value, metric));

// The median difference. If failures decide, says who fails more often.
export function difference(item, metric) {
  if (Number.isFinite(item.difference)) return amount(item.difference, metric);
  if (!item.fails_more) return '–';
  return item.fails_more === 'variant' ? 'fails more often' : other(item) + ' fails more often';
}

// "0.08 to 0.17 mm worse" or "0.03 mm better to 0.05 mm worse", the bounds in the order of the sentences: that in the
// direction of the difference comes last. A bound that is not a number stands for a failure of one of the two. Where
// the sentence gives no interval, there is none here.
export function interval(item, metric) {
  const {low, high} = item;
  if (item.has_interval === false || (!Number.isFinite(low) && !Number.isFinite(high))) return '–';
  const failure = (is_high) =>
      (is_high !== Boolean(metric.higher_is_better) ? 'a failure' : other(item) + '’s failure');
  const bound = (value, is_high) => (Number.isFinite(value) ? amount(value, metric) : failure(is_high));
  const is_turned =
      item.fails_more ? (item.fails_more === 'variant') === Boolean(metric.higher_is_better) : item.difference < 0;
  if (low * high > 0 && Number.isFinite(low) && Number.isFinite(high)) {
    const [near, far] = is_turned ? [high, low] : [low, high];
    return number(Math.abs(near)) + ' to ' + amount(far, metric);
  }
  const bounds = [bound(low, false), bound(high, true)];
  return (is_turned ? bounds.reverse() : bounds).join(' to ');
}
