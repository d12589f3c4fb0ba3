/*
 * staged --darken: what a station that was killed may have left burning goes dark.
 */
#pragma once

#include "base/diag.h"
#include "base/exit_codes.h"

/* Opens the trigger of the config and disarms it; nothing else of the stage needs to be in order. A
 * trigger without strobes is dark already. After a station that was refused (EXIT_STATUS of
 * systemd) it does nothing. Any failure has a message. */
enum exit_code darken(const char *config_path, struct diag *diag);
