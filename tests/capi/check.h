/* Checks for the tests of the C interface: a failed one prints its place and lets the test fail at its end. */
#ifndef CHECK_H
#define CHECK_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "kschur.h"

static int checks_failed = 0;

#define CHECK(condition) \
   do { \
      if (!(condition)) { \
         printf("%s:%d: not true: %s\n", __FILE__, __LINE__, #condition); \
         checks_failed++; \
      } \
   } while (0)

#define CHECK_STATUS(call, expected) \
   do { \
      int status_ = (call); \
      if (status_ != (expected)) { \
         printf("%s:%d: status %d, not %s: %s\n", __FILE__, __LINE__, status_, #expected, #call); \
         checks_failed++; \
      } \
   } while (0)

#define CHECK_OK(call) CHECK_STATUS(call, KSCHUR_OK)

#define CHECK_NEAR(value, expected, tolerance) \
   do { \
      double value_ = (value), expected_ = (expected); \
      if (!(fabs(value_ - expected_) <= (tolerance))) { \
         printf("%s:%d: %s is %.17g, not %.17g\n", __FILE__, __LINE__, #value, value_, expected_); \
         checks_failed++; \
      } \
   } while (0)

/* Whether the message of a handle holds these words; `kind` is problem, options or result. */
#define CHECK_MESSAGE(kind, handle, words) \
   do { \
      char message_[2000] = ""; \
      kschur_##kind##_get_message(handle, message_, sizeof message_); \
      if (strlen(words) == 0 ? message_[0] != '\0' : strstr(message_, words) == NULL) { \
         printf("%s:%d: the message is \"%s\", without \"%s\"\n", __FILE__, __LINE__, message_, words); \
         checks_failed++; \
      } \
   } while (0)

static inline int report_checks(void)
{
   if (checks_failed > 0) printf("%d checks failed\n", checks_failed);
   return checks_failed > 0;
}

#endif
