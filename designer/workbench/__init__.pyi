from .record import (
    Record as Record,
    RecordedMotion as RecordedMotion,
)
