"""What has to hold before any work: options, responses, ngspice; and whose fault it is if not."""

from __future__ import annotations
