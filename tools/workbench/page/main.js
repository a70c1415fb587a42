// SPDX-License-Identifier: Apache-2.0
// The workbench: each page adds itself, in the order of the bar, and each panel of a case adds itself to its page.
import './home.js';
import './case.js';
import './ct_panel.js';
import './labels_panel.js';
import './fragments_panel.js';
import './segmentation_panel.js';
import './save_panel.js';
import './xrays.js';
import './xray_views.js';
import './place.js';
import './pipeline.js';
import './results.js';

import * as Shell from './shell.js';

Shell.start();
