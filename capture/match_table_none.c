// match_table_none.c - builds without SQLite know nothing of pairs
// SPDX-License-Identifier: BSD-3-Clause
#include "capture/match_table.h"

bool vt_can_read_match_tables(void) {
  return false;
}

bool vt_read_match_table(const char *database, vt_pair_function hear, void *user) {
  (void)database;
  (void)hear;
  (void)user;
  return false;
}
