// SPDX-License-Identifier: Apache-2.0
// The button that changes between light and dark. The browser keeps what was chosen.

export function startTheme() {
  const button = document.getElementById('theme'), root = document.documentElement;
  const stored = () => {
    try {
      return localStorage.getItem('marrow-theme');
    } catch (error) {
      return null;
    }
  };
  const dark = () =>
      (root.dataset.theme ? root.dataset.theme === 'dark' : matchMedia('(prefers-color-scheme: dark)').matches);
  const label = () => (button.textContent = dark() ? 'Light' : 'Dark');
  button.title = 'Change between light and dark';
  if (stored()) root.dataset.theme = stored();
  button.addEventListener('click', () => {
    root.dataset.theme = dark() ? 'light' : 'dark';
    try {
      localStorage.setItem('marrow-theme', root.dataset.theme);
    } catch (error) { /* from disk some browsers keep nothing */
    }
    label();
  });
  // The workbench tells a report in its frame which theme was chosen there.
  addEventListener('message', ({data}) => {
    if (!data || data.marrow !== 'theme' || !['light', 'dark'].includes(data.theme)) return;
    root.dataset.theme = data.theme;
    label();
  });
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', label);
  label();
}
