// check_table.h - voltree capture --check: photographs looked at before the work
// SPDX-License-Identifier: BSD-3-Clause
#ifndef VT_PROGRAMS_CHECK_TABLE_H
#define VT_PROGRAMS_CHECK_TABLE_H

#include "programs/session.h"

// Looks at the photographs of a source, prints what is wrong with them and what the work would take, and the JSON document.
vt_status vt_check_source(vt_session *, const char *source);

#endif
