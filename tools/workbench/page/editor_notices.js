// SPDX-License-Identifier: Apache-2.0
// What the licences of the libraries ask for: a page that holds their code also holds these notices. esbuild keeps such
// comments.
/*! In this page as well:

CodeMirror: Copyright (C) 2017 by Marijn Haverbeke and others, under the MIT licence
d3-dispatch, d3-drag, d3-ease, d3-timer, d3-transition, d3-zoom: Copyright 2010-2018 Mike Bostock, under the BSD licence

Both licences: https://opensource.org/license/mit, https://opensource.org/license/bsd-3-clause */
