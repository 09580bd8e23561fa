// match_table_sqlite.c - colmap's database read through SQLite
// SPDX-License-Identifier: BSD-3-Clause
//
// Table two_view_geometries: pair_id = 2147483647 * (smaller image_id) + (larger image_id), rows = inliers of the geometry.
#include "capture/match_table.h"

#include <sqlite3.h>

static const char query[] = "SELECT a.name, b.name, g.rows FROM two_view_geometries g "
                            "JOIN images a ON a.image_id = (g.pair_id - g.pair_id % 2147483647) / 2147483647 "
                            "JOIN images b ON b.image_id = g.pair_id % 2147483647 WHERE g.rows > 0";

bool vt_can_read_match_tables(void) {
  return true;
}

bool vt_read_match_table(const char *database, vt_pair_function hear, void *user) {
  sqlite3 *file = NULL;
  sqlite3_stmt *rows = NULL;
  int result = sqlite3_open_v2(database, &file, SQLITE_OPEN_READONLY, NULL);
  if (result == SQLITE_OK) result = sqlite3_prepare_v2(file, query, -1, &rows, NULL);
  while (result == SQLITE_OK || result == SQLITE_ROW) {
    result = sqlite3_step(rows);
    const char *a = (const char *)sqlite3_column_text(rows, 0), *b = (const char *)sqlite3_column_text(rows, 1);
    if (result == SQLITE_ROW && a && b) hear(user, a, b, sqlite3_column_int(rows, 2));
  }
  sqlite3_finalize(rows);
  sqlite3_close(file);
  return result == SQLITE_DONE;
}
