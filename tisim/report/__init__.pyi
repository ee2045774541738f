from .run_report import run_report as run_report
